// How the drawn hand's bones stand for a pose. Bones are WebXR's joints: -Z of a joint points to the next one, Y to the
// back of the hand, so flexion turns about -X. The mesh's bones are one flat list; chains are made here. The hand is a right one.
import { MathUtils, Vector3, type Object3D, type Quaternion } from 'three';
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

interface Joint {
  bone: Object3D;
  rest: Quaternion;
  restBend_rad: number; // how far it is bent in the mesh as it was modelled
  finger: FingerName;
  joint: number;
}

// Where another bone is, seen from this one.
export function seenFrom(bone: Object3D, other: Object3D): Vector3 {
  return bone.worldToLocal(other.getWorldPosition(new Vector3()));
}

// Bend between the bones before and behind it, about the joint's own axis; positive towards the palm.
function restBend_rad(before: Object3D, at: Object3D, behind: Object3D): number {
  const angle = (v: Vector3): number => Math.atan2(-v.y, -v.z);
  return angle(seenFrom(at, behind)) - angle(seenFrom(at, before).negate());
}

export class Skeleton {
  private readonly joints: Joint[] = [];

  // `bones`: as the mesh was modelled, none within another.
  constructor(readonly bones: ReadonlyMap<string, Object3D>) {
    for (const finger of kFingers) {
      const chain = ['wrist', ...chainOf(finger)].map((name) => bones.get(name)!);
      const bends_rad = chain.map((bone, i) => (i > 1 && chain[i + 1] ? restBend_rad(chain[i - 1]!, bone, chain[i + 1]!) : 0));
      chain.slice(1).forEach((bone, link) => {
        chain[link]!.attach(bone);
        const joint = jointAt(finger, link);
        if (joint < 0 || joint > 2) return;
        this.joints.push({ bone, rest: bone.quaternion.clone(), restBend_rad: bends_rad[link + 1]!, finger, joint });
      });
    }
  }

  apply(pose: HandPose): void {
    for (const { bone, rest, restBend_rad, finger, joint } of this.joints) {
      const { flex_deg, abduct_deg } = pose.fingers[finger];
      bone.quaternion.copy(rest);
      if (joint === 0) bone.rotateY(MathUtils.degToRad(-abduct_deg));
      bone.rotateX(restBend_rad - MathUtils.degToRad(flex_deg[joint]!));
    }
  }
}
