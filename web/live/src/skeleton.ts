// How the drawn hand's bones stand for a pose. Bones are WebXR's joints: -Z of a joint points to the next one, Y to the
// back of the hand, so flexion turns about -X. The mesh's bones are one flat list; chains are made here. The hand is a right one.
import { Matrix4, Vector3 } from 'three';
import { kFingers, type FingerName, type HandPose } from './mapping';

export function chainOf(finger: FingerName): string[] {
  if (finger === 'thumb') return ['thumb-metacarpal', 'thumb-phalanx-proximal', 'thumb-phalanx-distal', 'thumb-tip'];
  return ['metacarpal', 'phalanx-proximal', 'phalanx-intermediate', 'phalanx-distal', 'tip'].map(
    (part) => `${finger}-finger-${part}`,
  );
}

// Which of the pose's three joints turns at which bone of the chain: a finger's metacarpal stays with the palm.
export function jointAt(finger: FingerName, link: number): number {
  return finger === 'thumb' ? link : link - 1;
}

interface Link {
  bone: string;
  fromParent: Matrix4; // at rest
  restBend_rad: number; // how far the joint is bent in the mesh as it was modelled
  joint: number;
}

function position(matrix: Matrix4): Vector3 {
  return new Vector3().setFromMatrixPosition(matrix);
}

// Bend at `at` between the bones before and behind it, about the joint's own axis; positive towards the palm.
function restBend(before: Matrix4, at: Matrix4, behind: Matrix4): number {
  const inJoint = at.clone().invert();
  const incoming = position(at).sub(position(before)).transformDirection(inJoint);
  const outgoing = position(behind).sub(position(at)).transformDirection(inJoint);
  const angle = (v: Vector3): number => Math.atan2(-v.y, -v.z);
  return angle(outgoing) - angle(incoming);
}

export class Skeleton {
  private readonly chains = new Map<FingerName, Link[]>();
  readonly world = new Map<string, Matrix4>();
  private readonly turn = new Matrix4();
  private readonly tilt = new Matrix4();

  // `rest`: where each bone is in the mesh as it was modelled.
  constructor(rest: ReadonlyMap<string, Matrix4>) {
    const wrist = rest.get('wrist')!;
    this.world.set('wrist', wrist.clone());
    for (const finger of kFingers) {
      const bones = chainOf(finger);
      this.chains.set(
        finger,
        bones.map((bone, link) => {
          const own = rest.get(bone)!;
          const parent = link === 0 ? wrist : rest.get(bones[link - 1]!)!;
          const next = rest.get(bones[link + 1] ?? bone)!;
          const joint = jointAt(finger, link);
          const bends = joint >= 0 && joint < 3 && link > 0 && link + 1 < bones.length;
          this.world.set(bone, own.clone());
          return {
            bone,
            fromParent: parent.clone().invert().multiply(own),
            restBend_rad: bends ? restBend(parent, own, next) : 0,
            joint,
          };
        }),
      );
    }
  }

  apply(pose: HandPose): void {
    for (const finger of kFingers) {
      const { flex_deg, abduct_deg } = pose.fingers[finger];
      let parent = this.world.get('wrist')!;
      for (const link of this.chains.get(finger)!) {
        const own = this.world.get(link.bone)!;
        own.multiplyMatrices(parent, link.fromParent);
        if (link.joint >= 0 && link.joint < 3) {
          const bend = (flex_deg[link.joint]! * Math.PI) / 180 - link.restBend_rad;
          if (link.joint === 0) own.multiply(this.tilt.makeRotationY((-abduct_deg * Math.PI) / 180));
          own.multiply(this.turn.makeRotationX(-bend));
        }
        parent = own;
      }
    }
  }
}
