// The hands that the page ships: do they bend towards the palm, by the angle that was asked for?
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { Matrix4, Quaternion, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { kFingers, restPose, type FingerName, type HandPose } from './mapping';
import { chainOf, Skeleton } from './skeleton';

interface Node {
  name: string;
  translation?: [number, number, number];
  rotation?: [number, number, number, number];
}

function rest(side: string): Map<string, Matrix4> {
  const file = createRequire(import.meta.url).resolve(
    `@webxr-input-profiles/assets/dist/profiles/generic-hand/${side}.glb`,
  );
  const bytes = readFileSync(file);
  const { nodes } = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString()) as { nodes: Node[] };
  return new Map(
    nodes
      .filter((node) => node.translation && node.rotation)
      .map((node) => [
        node.name,
        new Matrix4().compose(
          new Vector3(...node.translation!),
          new Quaternion(...node.rotation!),
          new Vector3(1, 1, 1),
        ),
      ]),
  );
}

function posed(finger: FingerName, flex_deg: [number, number, number]): HandPose {
  const pose = restPose();
  pose.fingers[finger] = { flex_deg, abduct_deg: 0, sensed: [true, true, true] };
  return pose;
}

function at(skeleton: Skeleton, bone: string): Vector3 {
  return new Vector3().setFromMatrixPosition(skeleton.world.get(bone)!);
}

describe.each(['left', 'right'])('the %s hand', (side) => {
  const bones = rest(side);
  const back = new Vector3(0, 1, 0).transformDirection(bones.get('wrist')!);

  it('has WebXR’s 25 joints', () => {
    for (const finger of kFingers) for (const bone of chainOf(finger)) expect(bones.has(bone), bone).toBe(true);
    expect(kFingers.flatMap(chainOf).length + 1).toBe(25);
  });

  it.each(['index', 'middle', 'ring', 'pinky'] as FingerName[])('bends the %s as asked, towards the palm', (finger) => {
    const skeleton = new Skeleton(bones, side === 'right');
    const [metacarpal, proximal, intermediate, distal, tip] = chainOf(finger) as [
      string,
      string,
      string,
      string,
      string,
    ];
    const bend = (a: string, b: string, c: string): number =>
      (at(skeleton, b)
        .sub(at(skeleton, a))
        .angleTo(at(skeleton, c).sub(at(skeleton, b))) *
        180) /
      Math.PI;
    skeleton.apply(posed(finger, [0, 0, 0]));
    const straight = at(skeleton, tip);
    expect(bend(proximal, intermediate, distal)).toBeLessThan(8);
    skeleton.apply(posed(finger, [70, 50, 30]));
    expect(bend(metacarpal, proximal, intermediate)).toBeGreaterThan(62);
    expect(bend(metacarpal, proximal, intermediate)).toBeLessThan(78);
    expect(Math.abs(bend(proximal, intermediate, distal) - 50)).toBeLessThan(6);
    expect(Math.abs(bend(intermediate, distal, tip) - 30)).toBeLessThan(12); // the model's tips lie beside their bones
    expect(at(skeleton, tip).sub(straight).dot(back)).toBeLessThan(-0.03);
  });

  it('brings the thumb over the palm', () => {
    const skeleton = new Skeleton(bones, side === 'right');
    skeleton.apply(posed('thumb', [0, 0, 0]));
    const middle = at(skeleton, 'middle-finger-phalanx-proximal');
    const open = at(skeleton, 'thumb-tip').distanceTo(middle);
    skeleton.apply(posed('thumb', [20, 70, 40]));
    expect(at(skeleton, 'thumb-tip').distanceTo(middle)).toBeLessThan(open - 0.015);
  });

  it('keeps every bone’s length', () => {
    const skeleton = new Skeleton(bones, side === 'right');
    skeleton.apply(posed('index', [80, 90, 60]));
    const chain = chainOf('index');
    for (let i = 1; i < chain.length; ++i) {
      const before = new Vector3()
        .setFromMatrixPosition(bones.get(chain[i]!)!)
        .distanceTo(new Vector3().setFromMatrixPosition(bones.get(chain[i - 1]!)!));
      expect(at(skeleton, chain[i]!).distanceTo(at(skeleton, chain[i - 1]!))).toBeCloseTo(before, 5);
    }
  });
});
