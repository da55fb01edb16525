// What came over the socket, for whoever draws.
import { Ring } from './ring';
import { poseFromAngles, poseFromPosture, type HandPose } from './mapping';
import { kept } from './kept';
import type { Marker } from './socket';
import type { Finger, Maybe, State } from './state';
import { kHandSamples, kSamples, type Picture, type Samples } from './wire';

const kMostMarkers = 500; // as the program

export class Store {
  state!: State; // before the first one nothing is drawn but that it is waited for
  connected = false;
  isLost = false; // the connection, for longer than a blink
  announced = '';
  picture = ''; // the newest of the program's camera, as an address
  glove = new Ring(0); // of each finger its reading, then of each its angle
  markers: Marker[] = [];
  private hand: Float32Array | null = null; // the newest angles
  private posture: Float32Array | null = null; // likewise
  openHand_deg = kept('open_hand'); // what the wearer calls an open hand; null: what the model does

  greet(schema: number): void {
    this.markers = []; // those that it has come next
    if (schema !== 1) this.announced = `The program speaks schema ${schema} and this page schema 1. Reload the page.`;
  }

  takeState(state: State): void {
    this.state = state;
    if (!state.posture) this.posture = null;
    if (!state.hand) this.hand = null;
    if (!state.calibration) this.takePicture(null);
  }

  takeSamples(samples: Samples): void {
    const { kind, channels, host_s, values } = samples;
    if (kind === kSamples) {
      if (this.glove.channels !== 2 * channels) this.glove = new Ring(2 * channels);
      host_s.forEach((t_s, row) => this.glove.push(t_s, values, 2 * row * channels));
    } else if (host_s.length > 0) {
      this[kind === kHandSamples ? 'hand' : 'posture'] = values.slice(values.length - channels);
    }
  }

  takePicture(picture: Picture | null): void {
    URL.revokeObjectURL(this.picture);
    this.picture = picture ? URL.createObjectURL(new Blob([picture.jpeg], { type: 'image/jpeg' })) : '';
  }

  takeMarker(marker: Marker): void {
    this.markers = [...this.markers, marker].slice(-kMostMarkers);
  }

  // Of the finger `channel`, as far as the ring is of these fingers.
  latest_deg(channel: number): number {
    const { fingers } = this.state;
    return this.glove.channels === 2 * fingers.length
      ? this.glove.last(fingers.length + channel)
      : (fingers[channel]!.angle_deg ?? NaN);
  }

  // The angle as the wearer calls it. NaN: not known.
  called_deg(finger: Finger | undefined, angle_deg: Maybe): number {
    const open_deg = finger?.open_deg ?? null;
    return (angle_deg ?? NaN) + (open_deg === null || this.openHand_deg === null ? 0 : Number(this.openHand_deg) - open_deg);
  }

  // The wearer's hand. Without samples the state's own angles stand in.
  handPose(): HandPose {
    const { fingers, posture } = this.state;
    const names = fingers.map(({ name }) => name);
    if (posture && this.posture) return poseFromPosture(posture.names, this.posture, names);
    return poseFromAngles(
      names,
      fingers.map((_, channel) => this.latest_deg(channel)),
      fingers.map(({ open_deg }) => open_deg),
    );
  }

  bionicPose(): HandPose | null {
    const { hand } = this.state;
    if (!hand || this.hand?.length !== hand.names.length) return null;
    return poseFromAngles(hand.names, this.hand, hand.open_deg);
  }
}
