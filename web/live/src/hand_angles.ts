// From the 21 points that a hand landmarker finds in a picture to joint angles in the picture's plane: what a camera sees that
// looks at the hand from the side.
//
//   turn = atan2(u x v, u . v)   of one bone after the other, degrees
//
// Flexion is positive, and zero when straight, as in models/joints/green_markers.json. Fingertips are left out: of the last
// joint such points give no angle.

export interface Point {
  x: number; // pixels
  y: number;
}

const kWrist = 0;
const kFirst = { index: 5, middle: 9, ring: 13, pinky: 17 } as const; // MCP; PIP, DIP and tip follow
export const kPoints = 21;
export const kBones: readonly (readonly [number, number])[] = [
  ...[1, 5, 17].map((first) => [kWrist, first] as const),
  ...[5, 9, 13].map((mcp) => [mcp, mcp + 4] as const),
  ...[1, 5, 9, 13, 17].flatMap((first) => [0, 1, 2].map((k) => [first + k, first + k + 1] as const)),
];

const kClear_deg = 40; // the fingers' bends together, from which the direction of flexion is determined

// Degrees, positive clockwise on the screen, whose y grows downwards. NaN: two points coincide.
export function turn_deg(a: Point, b: Point, c: Point): number {
  const u = { x: b.x - a.x, y: b.y - a.y };
  const v = { x: c.x - b.x, y: c.y - b.y };
  if (u.x * u.x + u.y * u.y < 1 || v.x * v.x + v.y * v.y < 1) return NaN;
  return (Math.atan2(u.x * v.y - u.y * v.x, u.x * v.x + u.y * v.y) * 180) / Math.PI;
}

// Which turn is flexion: a middle joint bends one way only. `before`, while the fingers are too straight for that.
export function flexionSign(points: readonly Point[], before: 1 | -1): 1 | -1 {
  const sum = Object.values(kFirst)
    .map((mcp) => turn_deg(points[mcp]!, points[mcp + 1]!, points[mcp + 2]!))
    .reduce((a, b) => a + b, 0);
  return Math.abs(sum) > kClear_deg ? (sum > 0 ? 1 : -1) : before;
}

// MCP and PIP of the four fingers; null where the points give none.
export function jointAngles(points: readonly Point[], sign: 1 | -1): Record<string, number> | null {
  if (points.length !== kPoints) return null;
  const angles: Record<string, number> = {};
  for (const [finger, mcp] of Object.entries(kFirst)) {
    angles[`${finger}_mcp`] = sign * turn_deg(points[kWrist]!, points[mcp]!, points[mcp + 1]!);
    angles[`${finger}_pip`] = sign * turn_deg(points[mcp]!, points[mcp + 1]!, points[mcp + 2]!);
  }
  return Object.values(angles).every(Number.isFinite) ? angles : null;
}
