// What the server says, as apps/live/SOCKET.md has it. Everything may be missing: a value that is not known is null.

export type Quality = 'good' | 'fair' | 'poor' | 'none';
export type Side = 'left' | 'right';
export type Maybe = number | null;

export interface Device {
  status: 'none' | 'listening' | 'glove' | 'gone' | 'replay' | 'twin' | 'boards';
  name: string | null;
  port: string | null;
  format: string | null;
  says: string | null;
}

export interface Finger {
  name: string;
  unit: string | null;
  raw: Maybe;
  angle_deg: Maybe;
  sd_deg: Maybe;
  open_deg: Maybe; // its ends: of a joint that a model has
  fist_deg: Maybe;
  covered: Maybe;
  quality: Quality;
  remark: string | null;
  tracked?: string | null;
}

export interface Coverage {
  name: string;
  range: Maybe;
  slow: Maybe;
  fast: Maybe;
  holds: Maybe;
  missing: string | null;
}

export type Verdict = 'better' | 'as good' | 'worse' | 'astray' | 'expected';

export interface FingerResult {
  name: string;
  error_deg: Maybe;
  line_deg: Maybe;
  baseline: string | null; // the best of five, which the verdict is beside
  baseline_deg: Maybe;
  fit_percent: Maybe;
  verdict: Verdict | null;
  reference_error_deg?: Maybe; // of the reference itself, where it is known to err
}

export interface ResultPlot {
  t_s: Maybe[];
  finger: string;
  reference_deg: Maybe[];
  model_deg: Maybe[];
  line_deg: Maybe[];
}

export const kSteps = ['glove', 'reference', 'motion', 'identify', 'result', 'send'] as const;
export type Step = (typeof kSteps)[number];
export type Reference = 'marks' | 'poses' | 'markerless' | 'drawn';

export interface Calibration {
  step: Step;
  reference: Reference;
  camera: 'page' | 'server' | 'none';
  joints: string | null;
  asks: string | null; // a kind (words.ts), and so is `then`
  seconds: Maybe;
  of_seconds: Maybe;
  left_s: Maybe; // until there is something else to do
  then: string | null;
  covered: Coverage[] | null;
  pictures: Maybe;
  marks_found: Maybe; // of the newest picture
  marks: Maybe;
  marks_at: [number, number][]; // where they are in the newest picture, as shares of its width and height
  tracked: Maybe;
  failed?: string | null;
  result: {
    fingers: FingerResult[];
    plot: ResultPlot | null;
    warnings?: string[] | null;
    report?: string | null;
  } | null;
}

export interface AnewFinger {
  name: string;
  before_deg: Maybe;
  after_deg: Maybe;
  verdict: string | null;
}

export interface Model {
  path: string;
  name: string | null;
  person: string | null;
  side: Side | null;
}

export interface Session {
  name: string;
  person: string | null;
  side: Side | null;
  files: string[];
  seconds: Maybe;
}

export interface Score {
  label: string;
  total_deg_s: Maybe;
  gestures_deg_s: Maybe[];
}

export interface Job {
  name: string;
  stage: string | null;
  share: Maybe;
  left_s: Maybe;
}

export interface Next {
  kind: string;
  why?: string;
  finger?: string;
  misfits?: string;
}

export interface State {
  device: Device | null;
  next: Next | null;
  fingers: Finger[];
  model: Model | null;
  recording: { file: string; rows: number; seconds: number } | null;
  job: Job | null;
  last: { job: string; ok: boolean; text: string } | null;
  link: { rate_hz: Maybe; torn: Maybe; lost: Maybe; jitter_ms: Maybe; latency_ms: Maybe } | null;
  calibration: Calibration | null;
  tracking: boolean | null;
  tracking_remark: string | null;
  anew: { seconds: Maybe; of_seconds: Maybe; fingers: AnewFinger[] | null } | null;
  twin: { slip_deg: Maybe; drift_deg_per_min: Maybe; noise_counts: Maybe; loss: Maybe } | null;
  posture: { names: string[] } | null;
  hand: { names: string[]; open_deg: number[]; status: string; port?: string | null; faults: string[] | null; board?: string } | null;
  scores: Score[];
  experiment: { compensator: string; total_deg_s: Maybe }[] | null;
  joint_files: string[];
  replay: { file: string; t_s: Maybe; of_s: Maybe; playing: boolean } | null;
  sessions: Session[];
  models: Model[];
  ports: { path: string; name: string | null }[];
}

// Before the program has said anything.
export const kNothing: State = {
  ...{ fingers: [], scores: [], joint_files: [], sessions: [], models: [], ports: [] },
  ...{ device: null, next: null, model: null, hand: null, posture: null, link: null, twin: null, replay: null },
  ...{ experiment: null, recording: null, job: null, last: null, calibration: null, anew: null },
  ...{ tracking: null, tracking_remark: null },
};
