// Wear: the hand, what to do next, a card for each finger, and what one does while wearing.
import { Cards } from './cards';
import { Anew, Glove, Model, Record } from './panels';
import { Stage } from './stage';

export function Wear() {
  return (
    <div class="wear">
      <div class="wear-main">
        <Stage />
        <Cards />
      </div>
      <div class="wear-side">
        <Record />
        <Glove />
        <Model />
        <Anew />
      </div>
    </div>
  );
}
