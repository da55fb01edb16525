// What the server sends, as apps/live/SOCKET.md has it. A value that is not known is null.

export type Quality = 'good' | 'fair' | 'poor' | 'none';
export type Side = 'left' | 'right';
export type Maybe = number | null;

export interface Device {
  status: 'none' | 'listening' | 'glove' | 'gone' | 'replay' | 'twin' | 'boards';
  name: string;
  port: string;
  format: string;
  says: string;
}

export interface Finger {
  name: string;
  unit: string;
  raw: Maybe;
  angle_deg: Maybe;
  sd_deg: Maybe;
  open_deg: Maybe; // its ends: of a joint that a model has
  fist_deg: Maybe;
  covered: Maybe;
  quality: Quality;
  remark: string;
  tracked: string;
}

export interface Coverage extends Record<'range' | 'slow' | 'fast' | 'holds', number> {
  name: string;
  missing: string;
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
  reference_error_deg: Maybe; // of the reference itself, where it is known to err
}

export interface ResultPlot extends Record<'reference_deg' | 'model_deg' | 'line_deg', Maybe[]> {
  t_s: number[];
  finger: string;
}

export const kSteps = ['glove', 'reference', 'motion', 'identify', 'result', 'send'] as const;
export type Reference = 'marks' | 'poses' | 'markerless' | 'drawn';

export interface Calibration {
  step: (typeof kSteps)[number];
  reference: Reference;
  camera: 'page' | 'server' | 'none';
  joints: string;
  asks: string; // a kind (words.ts), and so is `then`
  seconds: number;
  of_seconds: number;
  left_s: Maybe; // until there is something else to do
  then: string | null;
  covered: Coverage[];
  pictures: number;
  marks_found: number; // of the newest picture
  marks: number;
  marks_at: [number, number][]; // where they are in the newest picture, as shares of its width and height
  tracked: number;
  failed: string | null;
  result: { fingers: FingerResult[]; plot: ResultPlot | null; warnings: string[]; report: string | null } | null;
}

export interface Model {
  path: string;
  name: string;
  person: string;
  side: Side;
}

export interface Session {
  name: string;
  person: string;
  side: Side;
  files: string[];
  seconds: number;
}

export interface Job {
  name: string;
  stage: string;
  fraction: Maybe;
  seconds_left: Maybe;
}

export interface Next {
  kind: string;
  why?: string;
  finger?: string;
  misfits?: string;
}

export interface State {
  device: Device;
  next: Next;
  fingers: Finger[];
  model: Model | null;
  recording: { file: string; rows: number; seconds: number } | null;
  job: Job | null;
  last: { job: string; ok: boolean; text: string } | null;
  link: Record<'rate_hz' | 'torn' | 'jitter_ms' | 'latency_ms', number> & { lost: Maybe };
  calibration: Calibration | null;
  tracking: boolean;
  tracking_remark: string;
  anew: {
    seconds: number;
    of_seconds: number;
    fingers: { name: string; before_deg: Maybe; after_deg: Maybe; verdict: string }[];
  } | null;
  twin: Record<'slip_deg' | 'drift_deg_per_min' | 'noise_counts' | 'loss', number> | null;
  posture: { names: string[] } | null;
  hand: { names: string[]; open_deg: number[]; status: string; faults: string[]; board: string } | null;
  scores: { label: string; total_deg_s: number; gestures_deg_s: number[] }[];
  experiment: { compensator: string; total_deg_s: number }[] | null;
  joint_files: string[];
  replay: { file: string; t_s: number; of_s: number; playing: boolean } | null;
  sessions: Session[];
  models: Model[];
  ports: { path: string; name: string }[];
}
