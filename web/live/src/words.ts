// The sentence of each kind that the program sends (SOCKET.md).
import { number, title } from './text';
import type { Calibration, Next, State } from './state';

const kNext: Record<string, string> = {
  gone: 'The glove has gone: plug it in again.',
  misfit: '{why}',
  bend: 'Open your hand, make a fist, open it: again and again, all fingers from end to end.',
  fits: 'The glove is fitted to how it lies now.',
  keep: 'Nothing is changed, the old calibration stays: {why}{misfits}',
  as_it_was: 'The glove lies about as it did: the new calibration changes less than it is sure of.{misfits}',
  take: 'Take the new calibration, or keep the old one.{misfits}',
  listening: 'Listening to the port.',
  replay: 'A recording is played again: Look has its time line.',
  misunderstood: 'No glove is found: {why}',
  plug_in: 'Plug in the glove, and choose its port.',
  wait: 'Waiting for the glove’s first reading.',
  compensated:
    'The glove sends its own angles, and no readings of its sensors: what you see and record is what it sends. A calibration needs readings: flash the firmware of flexor deploy for them.',
  move: 'Move your fingers: no reading has changed yet.',
  name: 'No column is called like a finger: choose which is which.',
  calibrate: 'The glove moves. Calibrate it: three minutes with a camera, or one without.',
  model_misfit: 'The model that was chosen is not worn: {why}',
  look_at: 'Look at {finger}: {why}.',
  slipped: 'The glove has slipped: put on again, ten seconds.',
  wear: 'Wear it. Do “Put on again” whenever it has been off.',
};

const kAsks: Record<string, string> = {
  put_on: 'Put the glove on. Go on when its fingers move on the screen.',
  show_hand: 'Let the camera see your hand.',
  turn: 'Turn the hand so that the camera sees every mark.',
  seen: 'The camera sees the marks. Go on.',
  wait: 'Waiting for the glove’s readings.',
  watch: 'The simulated hand moves by itself.',
  open: 'Hold your hand open and still.',
  quick: 'Close and open it quickly, three times; then hold it open.',
  fist_slowly: 'Close it slowly to a fist, hold it, and open it slowly.',
  half: 'Close it half, hold it, then close it, hold it.',
  one_by_one: 'Bend one finger after the other, thumb first, each from end to end.',
  as_always: 'Open and close as you always do, the fingers a little after one another.',
  three_stops: 'Stop at three places on the way, a second each.',
  as_you_like: 'Move as you like.',
  fist: 'Make a fist and hold it.',
  open_again: 'Open it again and hold it.',
  fist_again: 'Make a fist once more and hold it.',
  rest: 'No rest was seen: hold the open hand, then a fist, each still for three seconds.',
  hidden: 'The camera does not see the marks: turn your hand towards it.',
  no_angles: 'The camera does not see every mark: turn your hand towards it.',
  missing: 'Go on until every finger below is complete.',
  enough: 'Enough. Go on.',
  identifies: 'The model is being identified.',
  failed: 'Nothing was identified: {failed}',
  result: 'This is the error on the part that the fit never saw. Accept the model, or repeat the motion.',
  accepted: 'The model is worn here now. Send it to the glove, or finish.',
  sent: 'The model is in the glove. Finish.',
};

// Where it is otherwise without marks, and by poses.
const kAsksMarkerless: Record<string, string> = {
  turn: 'Show the whole hand to the camera, from the side.',
  seen: 'The camera sees a hand. Keep its side to the camera, and go on.',
  hidden: 'The camera finds no hand: turn its side towards it.',
  no_angles: 'The camera sees no angles: turn the hand’s side towards it.',
  result:
    'This is the difference from the camera’s angles on the part that the fit never saw. They err themselves. Accept the model, or repeat the motion.',
};
const kAsksPoses: Record<string, string> = {
  result:
    'A straight line through both poses. Nothing was measured: the error is what is to be expected. Accept it, or repeat.',
};

const kMissing: Record<string, string> = {
  move: 'Open and close it',
  range: 'Open and close it from end to end',
  slow: 'Bend it slowly',
  holds: 'Hold it still, also half bent',
  fast: 'Bend it quickly',
};

const kRefused: Record<string, string> = {
  job_runs: '{job} runs: wait for it, or cancel it',
  anew_runs: 'ten seconds of a glove that was put on again are recorded: wait for them',
  calibration_is_open: 'a calibration is open, perhaps in another tab: go on with it, or cancel it',
  no_calibration: 'no calibration is open: start one',
  motion_runs: 'a calibration records its motion: finish it first',
  no_recording: 'no recording runs: start one first',
  recording_runs: 'a recording runs: stop it first',
  no_replay: 'nothing is replayed',
  replay_is_open: 'a recording is played again: leave it first',
  no_glove: 'no glove is found yet: plug it in',
  glove_gone: 'the glove has gone: plug it in again',
  another_glove: 'another glove was plugged in: what the one before sent is kept',
  hand_unseen: 'the camera does not see the hand yet',
  poses_too_short: '{seconds} s so far, {least_s} s are the least: go on with the poses',
  motion_too_short: '{seconds} s so far, {least_s} s are the least: keep moving',
  marks_too_seldom:
    'the camera has measured the angles {angles} times, {least} are the least: turn the marks towards it and keep moving',
  hand_too_seldom:
    'the camera has measured the angles {angles} times, {least} are the least: turn the hand’s side towards it and keep moving',
  identifies: 'the model is being identified: wait for it, or cancel',
  not_identified: 'nothing was identified: repeat the motion',
  accept_or_repeat: 'accept the model, or repeat the motion',
  first_step: 'this is the first step',
  nothing_to_repeat: 'there is nothing to repeat yet',
  no_plot: 'there is no plot of {finger}',
  no_readings:
    'this glove sends the angles that it makes and no readings, which a calibration needs: flash it with the firmware of flexor deploy',
  no_model: 'no model is worn: calibrate first, or choose one',
  model_misfit: 'the model that was chosen is not worn: {why}',
  not_tracked: 'this model cannot be tracked: identify it again',
  no_anew: 'no glove was put on again',
  anew_waits: 'the new calibration waits for an answer: take it, or keep the old one',
  nothing_to_accept: 'there is no new calibration to accept yet',
  no_twin: 'no twin wears the glove: start flexor live --demo',
  twin_wears: 'the twin wears the glove: start flexor live without --demo for a real one',
  no_board: 'no {board} is connected: plug it in, and choose its port',
  takes_no_models: 'this glove’s program takes no models: flexor deploy makes one that does',
  finger_twice: '{finger} is chosen twice: one column for each finger',
};

// "Look at {finger}" with its finger.
function filled(sentence: string, parts: Record<string, unknown>): string {
  return sentence.replaceAll(/\{(\w+)\}/g, (_, name: string) => {
    const part = parts[name] ?? '';
    return typeof part === 'number' ? number(part) : String(part);
  });
}

// An unknown kind is a newer program's: better than nothing.
export function askWords(kind: string, { reference, failed, result }: Calibration): string {
  const astray = (result?.fingers ?? []).filter(({ verdict }) => verdict === 'astray').map(({ name }) => title(name));
  if (kind === 'result' && astray.length > 0)
    return `The model does not follow ${astray.join(', ')}: repeat the motion, with the hand in the camera’s view all the time.`;
  const own = reference === 'markerless' ? kAsksMarkerless : reference === 'poses' ? kAsksPoses : {};
  return filled(own[kind] ?? kAsks[kind] ?? title(kind), { failed });
}

export function nextWords(next: Next, { job, calibration }: State): string {
  if (next.kind === 'job') return `${title(job?.name ?? 'a job')} runs.`;
  if (next.kind === 'calibration') return calibration ? askWords(calibration.asks, calibration) : '';
  return filled(kNext[next.kind] ?? title(next.kind), {
    ...next,
    misfits: next.misfits ? ` Does not fit: ${next.misfits}` : '',
  });
}

// What was refused, or the program's own line.
export function refusalWords(error: string, parts: Record<string, unknown> = {}): string {
  return filled(kRefused[error] ?? error, parts);
}

export function missingWords(kind: string): string {
  return kind ? (kMissing[kind] ?? title(kind)) : 'Complete';
}
