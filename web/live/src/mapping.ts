// From what is sensed to how the drawn hand bends.
//
// A glove senses an angle for each finger, most often the knuckle's. The others follow as in the article's eqs. 4 and 5
// and host/twin's posture(): PIP = 3/4 MCP and DIP = 2/3 MCP; the thumb's IP = 1/2 MCP.
//
// Where the whole hand comes (23 joints, models/posture.json), each joint is drawn as it comes.

import type { Maybe } from './state';

export const kFingers = ['thumb', 'index', 'middle', 'ring', 'pinky'] as const;
export type FingerName = (typeof kFingers)[number];

// Flexion from the palm outwards and abduction towards the thumb, degrees, 0 when straight; how each came about.
export interface FingerPose {
  flex_deg: [number, number, number]; // MCP, PIP, DIP; the thumb's: CMC, MCP, IP
  abduct_deg: number;
  sensed: [boolean, boolean, boolean];
}

export interface HandPose {
  fingers: Record<FingerName, FingerPose>;
  wrist_deg: [number, number]; // pitch, yaw
}

const kMostBend_deg: Record<'thumb' | 'other', [number, number, number]> = {
  thumb: [60, 80, 90],
  other: [95, 110, 80], // the drawn fingertip would go through the palm
};

// The finger that a channel lies on, and which of its joints; `little` and `pointer` are the clinic's and the article's.
export function fingerOf(channel: string): { finger: FingerName; joint: 0 | 1 | 2 } | null {
  const [first = '', rest = ''] = channel.toLowerCase().split(/[_ .-](.*)/);
  const finger = first === 'little' ? 'pinky' : first === 'pointer' ? 'index' : first;
  if (!(kFingers as readonly string[]).includes(finger)) return null;
  const name = finger as FingerName;
  if (name === 'thumb') return { finger: name, joint: /^(ip|distal)/.test(rest) ? 2 : /^(rot|cmc)/.test(rest) ? 0 : 1 };
  if (/^dip/.test(rest)) return { finger: name, joint: 2 };
  return { finger: name, joint: /^(pip|distal)/.test(rest) ? 1 : 0 };
}

function clamp(value: number, low: number, high: number): number {
  return Math.min(high, Math.max(low, value));
}

function limited(finger: FingerName, pose: FingerPose): FingerPose {
  const most = kMostBend_deg[finger === 'thumb' ? 'thumb' : 'other'];
  pose.flex_deg = pose.flex_deg.map((v, i) => clamp(v, -35, most[i]!)) as [number, number, number];
  pose.abduct_deg = clamp(pose.abduct_deg, -35, 45);
  return pose;
}

export function restPose(): HandPose {
  const fingers = {} as Record<FingerName, FingerPose>;
  for (const finger of kFingers) {
    const flex_deg: [number, number, number] = finger === 'thumb' ? [5, 12, 10] : [10, 14, 8];
    fingers[finger] = { flex_deg, abduct_deg: 0, sensed: [false, false, false] };
  }
  return { fingers, wrist_deg: [0, 0] };
}

// The joints of a finger whose knuckle bends by this.
export function spread(finger: FingerName, mcp_deg: number): [number, number, number] {
  if (finger === 'thumb') return [mcp_deg * 0.25, mcp_deg, mcp_deg / 2];
  return [mcp_deg, (mcp_deg * 3) / 4, (mcp_deg * 2) / 3];
}

// `names`: channels in order; an angle that is not known (NaN) leaves its finger at rest. `open_deg`: what each reads at the open hand,
// 0 where nothing gives it.
export function poseFromAngles(
  names: readonly string[],
  angle_deg: ArrayLike<number>,
  open_deg: readonly Maybe[] = [],
): HandPose {
  const pose = restPose();
  const known = new Map<FingerName, Map<number, number>>();
  names.forEach((name, channel) => {
    const at = fingerOf(name);
    const angle = angle_deg[channel] ?? NaN;
    if (!at || !Number.isFinite(angle)) return;
    if (!known.has(at.finger)) known.set(at.finger, new Map());
    known.get(at.finger)!.set(at.joint, angle - (open_deg[channel] ?? 0));
  });
  for (const [finger, joints] of known) {
    const lead = finger === 'thumb' ? 1 : 0;
    const mcp = joints.get(lead) ?? leadFrom(finger, joints);
    const flex_deg = spread(finger, mcp);
    const sensed: [boolean, boolean, boolean] = [false, false, false];
    for (const [joint, angle] of joints) {
      flex_deg[joint] = angle;
      sensed[joint] = true;
    }
    pose.fingers[finger] = limited(finger, { flex_deg, abduct_deg: 0, sensed });
  }
  return pose;
}

// The knuckle's angle where only joints beyond it are sensed.
function leadFrom(finger: FingerName, joints: Map<number, number>): number {
  const shares = spread(finger, 1);
  const [joint, angle] = [...joints][0]!;
  return angle / shares[joint]!;
}

// `names`: of models/posture.json; angles as SOCKET.md has them: flexion positive, 0 when straight. `sensedChannels`: what
// the glove's own channels see, so that the rest can be drawn as estimated.
export function poseFromPosture(
  names: readonly string[],
  angle_deg: ArrayLike<number>,
  sensedChannels: readonly string[],
): HandPose {
  const value = (name: string): number => {
    const at = names.indexOf(name);
    const angle = at < 0 ? NaN : (angle_deg[at] ?? NaN);
    return Number.isFinite(angle) ? angle : 0;
  };
  const pose = restPose();
  for (const finger of kFingers) {
    const joints = finger === 'thumb' ? ['rot', 'mcp', 'ip'] : ['mcp', 'pip', 'dip'];
    const flex_deg = joints.map((joint) => value(`${finger}_${joint}`)) as [number, number, number];
    pose.fingers[finger] = { flex_deg, abduct_deg: value(`${finger}_abd`), sensed: [false, false, false] };
  }
  // The thumb's rotation across the palm has its own sign and middle in these recordings, and goes three times as far as
  // the drawn hand's root can without leaving the palm.
  pose.fingers.thumb.flex_deg[0] = names.includes('thumb_rot') ? -(value('thumb_rot') + 60) * 0.3 : 5;
  for (const channel of sensedChannels) {
    const at = fingerOf(channel);
    if (at) pose.fingers[at.finger].sensed[at.joint] = true;
  }
  for (const finger of kFingers) limited(finger, pose.fingers[finger]);
  pose.wrist_deg = [clamp(value('wrist_pitch'), -60, 60), clamp(value('wrist_yaw'), -30, 30)];
  return pose;
}
