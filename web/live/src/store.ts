// What came over the socket, for whoever draws.
import { Ring } from './ring';
import { poseFromAngles, poseFromPosture, type HandPose } from './mapping';
import { kept } from './kept';
import type { Marker } from './socket';
import { kNothing, type Finger, type Maybe, type State } from './state';
import { kHandSamples, kPosture, kSamples, type Picture, type Samples } from './wire';

const kMostMarkers = 500; // as the program

class Channels {
  first = new Ring(0);
  angle = new Ring(0);
  latest = new Float32Array(0);

  take(samples: Samples): void {
    if (this.angle.channels !== samples.channels) {
      this.first = new Ring(samples.channels);
      this.angle = new Ring(samples.channels);
    }
    for (let row = 0; row < samples.rows; ++row) {
      const at = row * samples.channels;
      this.first.push(samples.host_s[row]!, samples.first, at);
      this.angle.push(samples.host_s[row]!, samples.angle_deg, at);
    }
    if (samples.rows > 0) this.latest = samples.angle_deg.slice((samples.rows - 1) * samples.channels);
  }

  forget(): void {
    this.first.clear();
    this.angle.clear();
    this.latest = new Float32Array(0);
  }
}

export class Store {
  state: State = kNothing;
  connected = false;
  isLost = false; // the connection, for longer than a blink
  announced = '';
  picture: Picture | null = null; // the newest of the program's camera
  readonly glove = new Channels();
  readonly hand = new Channels();
  markers: Marker[] = [];
  private posture: Float32Array | null = null;
  openHand_deg = kept('open_hand'); // what the wearer calls an open hand; null: what the model does

  takeState(state: State): void {
    this.state = state;
    if (!state.posture) this.posture = null;
    if (!state.hand) this.hand.forget();
    if (!state.calibration) this.picture = null;
  }

  takeSamples(samples: Samples): void {
    if (samples.kind === kSamples) this.glove.take(samples);
    else if (samples.kind === kHandSamples) this.hand.take(samples);
    else if (samples.kind === kPosture && samples.rows > 0) {
      this.posture = samples.angle_deg.slice((samples.rows - 1) * samples.channels);
    }
  }

  takeMarker(marker: Marker): void {
    this.markers = [...this.markers, marker].slice(-kMostMarkers);
  }

  fingerNames(): string[] {
    return this.state.fingers.map((finger) => finger.name);
  }

  // The angle as the wearer calls it. NaN: not known.
  called_deg(finger: Finger | undefined, angle_deg: Maybe): number {
    const open_deg = finger?.open_deg ?? null;
    return (angle_deg ?? NaN) + (open_deg === null || this.openHand_deg === null ? 0 : Number(this.openHand_deg) - open_deg);
  }

  // The wearer's hand. Without samples the state's own angles stand in.
  handPose(): HandPose {
    const names = this.fingerNames();
    if (this.state.posture && this.posture) return poseFromPosture(this.state.posture.names, this.posture, names);
    const { fingers } = this.state;
    const isNew = this.glove.latest.length === names.length;
    return poseFromAngles(
      names,
      isNew ? this.glove.latest : fingers.map((finger) => finger.angle_deg ?? NaN),
      fingers.map((finger) => finger.open_deg),
    );
  }

  bionicPose(): HandPose | null {
    const hand = this.state.hand;
    if (!hand || this.hand.latest.length !== hand.names.length) return null;
    return poseFromAngles(hand.names, this.hand.latest, hand.open_deg);
  }
}
