import { describe, expect, it } from 'vitest';
import { flexionSign, jointAngles, kBones, kPoints, turn_deg, type Point } from './hand_angles';

// A hand from the side, its metacarpals pointing up from the wrist, every finger bent by these angles: clockwise, or as in a mirror.
function hand(mcp_deg: number, pip_deg: number, mirrored = false): Point[] {
  const points: Point[] = Array.from({ length: kPoints }, () => ({ x: 0, y: 0 }));
  for (const first of [1, 5, 9, 13, 17]) {
    let [x, y, direction_deg] = [0, 0, -90];
    [100, 40, 25, 20].forEach((length, k) => {
      direction_deg += [0, mcp_deg, pip_deg, 10][k]!;
      x += length * Math.cos((direction_deg * Math.PI) / 180);
      y += length * Math.sin((direction_deg * Math.PI) / 180);
      points[first + k] = { x: mirrored ? -x : x, y };
    });
  }
  return points;
}

describe('turn', () => {
  it('is zero when straight, and positive clockwise on the screen', () => {
    expect(turn_deg({ x: 0, y: 0 }, { x: 5, y: 0 }, { x: 9, y: 0 })).toBe(0);
    expect(turn_deg({ x: 0, y: 0 }, { x: 5, y: 0 }, { x: 5, y: 4 })).toBeCloseTo(90);
    expect(turn_deg({ x: 0, y: 0 }, { x: 5, y: 0 }, { x: 5, y: -4 })).toBeCloseTo(-90);
  });
  it('of points that coincide is not a number', () => {
    expect(turn_deg({ x: 3, y: 3 }, { x: 3, y: 3 }, { x: 5, y: 4 })).toBeNaN();
  });
});

describe('joint angles', () => {
  const angles = (points: Point[]) => jointAngles(points, flexionSign(points, 1))!;
  it('are flexion, for a hand that bends to either side of the picture', () => {
    for (const mirrored of [false, true]) {
      const seen = angles(hand(40, 60, mirrored));
      expect(seen['index_mcp']).toBeCloseTo(40);
      expect(seen['pinky_pip']).toBeCloseTo(60);
    }
  });
  it('have the names of the joint files, and none of the thumb and of fingertips', () => {
    const fingers = ['index', 'middle', 'ring', 'pinky'];
    expect(Object.keys(angles(hand(10, 20)))).toEqual(fingers.flatMap((f) => [`${f}_mcp`, `${f}_pip`]));
  });
  it('keep their sign while the fingers are straight, and a knuckle may bend back', () => {
    const straight = hand(-15, 2, true);
    expect(flexionSign(straight, 1)).toBe(1);
    expect(flexionSign(straight, -1)).toBe(-1);
    expect(jointAngles(straight, -1)!['ring_mcp']).toBeCloseTo(-15);
    expect(angles(hand(-15, 30, true))['ring_mcp']).toBeCloseTo(-15);
  });
  it('do not depend on how large and where the hand is', () => {
    const moved = hand(35, 50).map(({ x, y }) => ({ x: 300 + 2.5 * x, y: 200 + 2.5 * y }));
    expect(angles(moved)['middle_mcp']).toBeCloseTo(35);
  });
  it('are none of a hand without all its points', () => {
    expect(jointAngles(hand(10, 10).slice(1), 1)).toBeNull();
    expect(jointAngles(hand(10, 10).map(() => ({ x: 1, y: 1 })), 1)).toBeNull();
  });
});

it('bones go through every point', () => {
  expect(new Set(kBones.flat()).size).toBe(kPoints);
});
