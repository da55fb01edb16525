// The hand that the page ships: does it bend towards the palm, by the angle that was asked for?
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { Object3D, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { kFingers, restPose, type FingerName, type HandPose } from './mapping';
import { chainOf, Skeleton } from './skeleton';

interface Node {
  name: string;
  translation?: [number, number, number];
  rotation?: [number, number, number, number];
}

function rest(): Map<string, Object3D> {
  const file = createRequire(import.meta.url).resolve('@webxr-input-profiles/assets/dist/profiles/generic-hand/right.glb');
  const bytes = readFileSync(file);
  const { nodes } = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString()) as { nodes: Node[] };
  const bones = new Map<string, Object3D>();
  for (const { name, translation, rotation } of nodes) {
    if (!translation || !rotation) continue;
    const bone = new Object3D();
    bone.position.set(...translation);
    bone.quaternion.set(...rotation);
    bones.set(name, bone);
  }
  return bones;
}

function posed(finger: FingerName, flex_deg: [number, number, number]): HandPose {
  const pose = restPose();
  pose.fingers[finger] = { flex_deg, abduct_deg: 0, sensed: [true, true, true] };
  return pose;
}

describe('the hand', () => {
  const bones = rest();
  const at = (bone: string, of = bones): Vector3 => of.get(bone)!.getWorldPosition(new Vector3());
  const back = new Vector3(0, 1, 0).applyQuaternion(bones.get('wrist')!.quaternion);
  const modelled = rest();
  const skeleton = new Skeleton(bones);

  it('has WebXR’s 25 joints', () => {
    for (const finger of kFingers) for (const bone of chainOf(finger)) expect(bones.has(bone), bone).toBe(true);
    expect(kFingers.flatMap(chainOf).length + 1).toBe(25);
  });

  it.each(['index', 'middle', 'ring', 'pinky'] as FingerName[])('bends the %s as asked, towards the palm', (finger) => {
    const [metacarpal, proximal, intermediate, distal, tip] = chainOf(finger) as [string, string, string, string, string];
    const bend = (a: string, b: string, c: string): number =>
      (at(b).sub(at(a)).angleTo(at(c).sub(at(b))) * 180) / Math.PI;
    skeleton.apply(posed(finger, [0, 0, 0]));
    const straight = at(tip);
    expect(bend(proximal, intermediate, distal)).toBeLessThan(8);
    skeleton.apply(posed(finger, [70, 50, 30]));
    expect(bend(metacarpal, proximal, intermediate)).toBeGreaterThan(62);
    expect(bend(metacarpal, proximal, intermediate)).toBeLessThan(78);
    expect(Math.abs(bend(proximal, intermediate, distal) - 50)).toBeLessThan(6);
    expect(Math.abs(bend(intermediate, distal, tip) - 30)).toBeLessThan(12); // the model's tips lie beside their bones
    expect(at(tip).sub(straight).dot(back)).toBeLessThan(-0.03);
  });

  it('brings the thumb over the palm', () => {
    skeleton.apply(posed('thumb', [0, 0, 0]));
    const middle = at('middle-finger-phalanx-proximal');
    const open = at('thumb-tip').distanceTo(middle);
    skeleton.apply(posed('thumb', [20, 70, 40]));
    expect(at('thumb-tip').distanceTo(middle)).toBeLessThan(open - 0.015);
  });

  it('keeps every bone’s length', () => {
    skeleton.apply(posed('index', [80, 90, 60]));
    const chain = chainOf('index');
    for (let i = 1; i < chain.length; ++i) {
      const length = at(chain[i - 1]!, modelled).distanceTo(at(chain[i]!, modelled));
      expect(at(chain[i]!).distanceTo(at(chain[i - 1]!))).toBeCloseTo(length, 5);
    }
  });
});
