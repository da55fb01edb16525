// What came over the socket, for whoever draws.
import { Ring } from './ring';
import { fingerOf, poseFromAngles, poseFromPosture, thumbStraight_deg, type HandPose } from './mapping';
import { kept } from './kept';
import type { Marker } from './socket';
import { completed, type Finger, type Maybe, type State } from './state';
import { kHandSamples, kPosture, kSamples, type Samples } from './wire';

const kMostMarkers = 500; // as the program

class Channels {
  first = new Ring(0);
  angle = new Ring(0);
  latest = new Float32Array(0);
  leastThumb_deg = Infinity;

  take(samples: Samples, names: readonly string[]): void {
    if (this.angle.channels !== samples.channels) {
      this.first = new Ring(samples.channels);
      this.angle = new Ring(samples.channels);
      this.leastThumb_deg = Infinity;
    }
    const thumb = names.findIndex((name) => fingerOf(name)?.finger === 'thumb' && fingerOf(name)?.joint === 1);
    for (let row = 0; row < samples.rows; ++row) {
      const at = row * samples.channels;
      this.first.push(samples.host_s[row]!, samples.first, at);
      this.angle.push(samples.host_s[row]!, samples.angle_deg, at);
      const bend = thumb < 0 ? NaN : samples.angle_deg[at + thumb]!;
      if (bend < this.leastThumb_deg) this.leastThumb_deg = bend;
    }
    if (samples.rows > 0) this.latest = samples.angle_deg.slice((samples.rows - 1) * samples.channels);
  }

  pose(names: readonly string[]): HandPose {
    return poseFromAngles(names, this.latest, thumbStraight_deg(this.leastThumb_deg));
  }

  forget(): void {
    this.first.clear();
    this.angle.clear();
    this.latest = new Float32Array(0);
    this.leastThumb_deg = Infinity;
  }
}

export class Store {
  state: State = completed({});
  connected = false;
  demo = false;
  readonly glove = new Channels();
  readonly hand = new Channels();
  markers: Marker[] = [];
  private posture: Float32Array | null = null;
  private source = '';
  openHand_deg = kept('open_hand'); // what the wearer calls an open hand; null: what the model does

  takeState(state: State): void {
    this.state = state;
    // Another glove, or another compensator for the thumb: its least angle is another, too.
    const source = JSON.stringify([
      state.device?.port,
      state.device?.status,
      state.model?.path,
      state.fingers.map((f) => f.name),
    ]);
    if (source !== this.source) {
      this.source = source;
      this.glove.leastThumb_deg = Infinity;
      this.hand.leastThumb_deg = Infinity;
    }
    if (!state.posture) this.posture = null;
    if (!state.hand) this.hand.forget();
  }

  takeSamples(samples: Samples): void {
    if (samples.kind === kSamples) this.glove.take(samples, this.fingerNames());
    else if (samples.kind === kHandSamples) this.hand.take(samples, this.state.hand?.names ?? []);
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
    if (this.glove.latest.length === names.length) return this.glove.pose(names);
    return poseFromAngles(
      names,
      this.state.fingers.map((finger) => finger.angle_deg ?? NaN),
    );
  }

  bionicPose(): HandPose | null {
    const hand = this.state.hand;
    return hand && this.hand.latest.length === hand.names.length ? this.hand.pose(hand.names) : null;
  }
}
