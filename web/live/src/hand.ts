// The hand in space: the wearer's, skinned, and beside it the bionic one, of rods. Drawn only when something has changed.
import * as three from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { kFingerColours, kShapes } from './colours';
import { kFingers, type FingerName, type HandPose } from './mapping';
import { css } from './plots';
import { chainOf, jointAt, seenFrom, Skeleton } from './skeleton';
import type { Quality, Side } from './state';

export type View = 'palm' | 'side' | 'back';
export type Qualities = Partial<Record<FingerName, Quality>>;
const kYaw_rad: Record<View, number> = { palm: 0.62, side: 1.45, back: 2.75 };

interface Loaded {
  mesh: three.SkinnedMesh;
  skeleton: Skeleton;
  markers: Map<string, three.Sprite>;
  bionic: Bionic;
}

type MarkKind = Quality | 'estimated';

// A mark's picture: its shape means as much as its colour.
function markTexture(kind: MarkKind, dark: boolean): three.CanvasTexture {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 96;
  const c = canvas.getContext('2d')!;
  const stroke = (colour: string, width: number): void => {
    c.strokeStyle = colour;
    c.lineWidth = width;
    c.stroke(shape);
  };
  const shape = new Path2D(kShapes[kind === 'estimated' ? 'none' : kind]);
  c.scale(6, 6);
  c.lineJoin = 'round';
  if (kind === 'estimated') {
    c.setLineDash([2.9, 2.3]);
    stroke(dark ? '#3a424a' : '#59626d', 1.2); // the hand is light in both schemes
  } else if (kind === 'none') {
    stroke('#ffffff', 2.7);
    stroke(css('--none'), 1.5);
  } else {
    c.fillStyle = css(`--${kind}`);
    c.fill(shape);
    stroke('#ffffff', 1.3);
  }
  const texture = new three.CanvasTexture(canvas);
  texture.colorSpace = three.SRGBColorSpace;
  return texture;
}

const kRod = new three.CylinderGeometry(1, 1, 1, 20);
const kBall = new three.SphereGeometry(1, 24, 16);
const kAlongRod = new three.Vector3(0, 1, 0);

// The other hand's rods and balls, each held by a bone.
class Bionic {
  readonly wrist: three.Object3D;
  readonly skeleton: Skeleton;
  private readonly frame = new three.MeshStandardMaterial({ roughness: 0.42, metalness: 0.25 });
  private readonly hinge = new three.MeshStandardMaterial({ roughness: 0.5, metalness: 0.3 });

  constructor(bones: ReadonlyMap<string, three.Object3D>) {
    this.skeleton = new Skeleton(new Map([...bones].map(([name, bone]) => [name, bone.clone(false)])));
    this.wrist = this.bone('wrist');
    const rubber = new three.MeshStandardMaterial({ color: 0x5d6a76, roughness: 0.85 });
    for (const finger of kFingers) {
      const bones = chainOf(finger);
      const thick = finger === 'pinky' ? 0.0052 : finger === 'thumb' ? 0.0068 : 0.006;
      this.addRod('wrist', bones[0]!, thick * 0.9);
      bones.slice(1).forEach((bone, i) => this.addRod(bones[i]!, bone, thick * (i === 0 ? 0.9 : 1 - 0.07 * i)));
      bones.slice(finger === 'thumb' ? 0 : 1, -1).forEach((bone) => this.addBall(bone, thick * 1.22, this.hinge));
      this.addBall(bones.at(-1)!, thick * 1.02, rubber);
    }
    for (const part of ['phalanx-proximal', 'metacarpal']) {
      const row = kFingers.slice(1).map((finger) => `${finger}-finger-${part}`);
      row.slice(1).forEach((bone, i) => this.addRod(row[i]!, bone, 0.0042, 'wrist'));
    }
    this.addBall('wrist', 0.011, this.hinge);
  }

  setDark(dark: boolean): void {
    this.frame.color.set(dark ? 0xa7b2bd : 0x97a2ad);
    this.hinge.color.set(dark ? 0x5b6874 : 0x39434d);
  }

  private bone(name: string): three.Object3D {
    return this.skeleton.bones.get(name)!;
  }

  private addRod(from: string, to: string, radius: number, holder = from): void {
    const mesh = new three.Mesh(kRod, this.frame);
    const [a, b] = [seenFrom(this.bone(holder), this.bone(from)), seenFrom(this.bone(holder), this.bone(to))];
    mesh.scale.set(radius, a.distanceTo(b), radius);
    mesh.position.lerpVectors(a, b, 0.5);
    mesh.quaternion.setFromUnitVectors(kAlongRod, b.sub(a).normalize());
    this.bone(holder).add(mesh);
  }

  private addBall(bone: string, radius: number, material: three.MeshStandardMaterial): void {
    const mesh = new three.Mesh(kBall, material);
    mesh.scale.setScalar(radius);
    this.bone(bone).add(mesh);
  }
}

export class HandScene {
  private readonly renderer: three.WebGLRenderer;
  private readonly scene = new three.Scene();
  private readonly hands = [new three.Group(), new three.Group()] as const; // the wearer's and the bionic, right; mirrored: left
  private readonly camera = new three.PerspectiveCamera(24, 1, 0.05, 5);
  private hand: Loaded | null = null; // until it is loaded
  private readonly textures = new Map<MarkKind, three.CanvasTexture>();
  private side: Side = 'left';
  private painted = '';
  private yaw_rad = kYaw_rad.palm;
  private dark = false;

  // `wanted` is called when there is something new to draw. Throws where the browser has no WebGL.
  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly wanted: () => void,
  ) {
    this.renderer = new three.WebGLRenderer({ canvas, antialias: true, alpha: true, powerPreference: 'low-power' });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    // These go with the camera, so that every view is lit as well as the first.
    const key = new three.DirectionalLight(0xffffff, 2.1);
    key.position.set(-5.6, 7, 8.3);
    const rim = new three.DirectionalLight(0xcfe4ff, 0.9);
    rim.position.set(6.8, 2, -7.4);
    this.camera.add(key, rim);
    const soft = [new three.HemisphereLight(0xffffff, 0x8a7f78, 1.25), new three.AmbientLight(0xffffff, 0.25)];
    this.scene.add(...soft, this.camera, ...this.hands);
    const scheme = window.matchMedia('(prefers-color-scheme: dark)');
    this.setDark(scheme.matches);
    scheme.addEventListener('change', () => this.setDark(scheme.matches));
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement!);
    this.resize();
  }

  setSide(side: Side): void {
    this.side = side;
    for (const group of this.hands) group.scale.x = side === 'left' ? -1 : 1;
    this.wanted();
  }

  setView(view: View): void {
    this.yaw_rad = kYaw_rad[view];
    this.wanted();
  }

  turn(by_rad: number): void {
    this.yaw_rad += by_rad;
    this.wanted();
  }

  // `bionic`: null where there is none. True: drawn.
  render(pose: HandPose, quality: Qualities, bionic: HandPose | null): boolean {
    const { hand } = this;
    if (!hand) return false;
    hand.skeleton.apply(pose);
    const [pitch, yaw] = pose.wrist_deg;
    const side = this.side === 'left' ? 1 : -1;
    this.hands[0].rotation.set((yaw * Math.PI) / 360, 0, (-side * pitch * Math.PI) / 360);
    this.paint(hand, pose, quality);
    if (bionic) hand.bionic.skeleton.apply(bionic);
    this.draw(bionic !== null);
    return true;
  }

  private setDark(dark: boolean): void {
    this.dark = dark;
    for (const kind of ['good', 'fair', 'poor', 'none', 'estimated'] as const) {
      this.textures.get(kind)?.dispose();
      this.textures.set(kind, markTexture(kind, dark));
    }
    this.hand?.bionic.setDark(dark);
    this.painted = '';
    this.wanted();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement!;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.wanted();
  }

  async load(file: string): Promise<void> {
    const gltf = await new GLTFLoader().loadAsync(file);
    let mesh: three.SkinnedMesh | null = null;
    const bones = new Map<string, three.Bone>();
    gltf.scene.updateMatrixWorld(true);
    gltf.scene.traverse((node) => {
      if (node instanceof three.SkinnedMesh) mesh = node;
      if (node instanceof three.Bone) bones.set(node.name, node);
    });
    const skinned = mesh as three.SkinnedMesh | null;
    if (!skinned) throw new Error(`${file} has no skinned hand`);
    const bionic = new Bionic(bones);
    const skeleton = new Skeleton(bones);
    skinned.frustumCulled = false;
    skinned.material = new three.MeshStandardMaterial({ vertexColors: true, roughness: 0.62, metalness: 0 });
    bionic.setDark(this.dark);
    [gltf.scene, bionic.wrist].forEach((hand, i) => {
      const group = new three.Group().add(hand);
      group.rotation.x = Math.PI; // fingers up, the middle of the hand at the turning axis
      group.position.set(-0.03, -0.035, 0);
      this.hands[i]!.add(group);
    });
    const markers = new Map<string, three.Sprite>();
    for (const finger of kFingers) {
      for (const bone of chainOf(finger).slice(finger === 'thumb' ? 0 : 1, -1)) {
        const sprite = new three.Sprite(new three.SpriteMaterial({ depthTest: false, transparent: true }));
        sprite.renderOrder = 2;
        markers.set(bone, sprite);
        bones.get(bone)!.add(sprite);
      }
    }
    this.hand = { mesh: skinned, skeleton, markers, bionic };
    this.wanted();
  }

  // Colours by what is sensed, and marks by quality; only when that has changed.
  private paint(hand: Loaded, pose: HandPose, quality: Qualities): void {
    const key = JSON.stringify([quality, kFingers.map((f) => pose.fingers[f].sensed), this.dark]);
    if (key === this.painted) return;
    this.painted = key;
    const neutral = new three.Color(this.dark ? 0xb9bdc4 : 0xe4dcd4);
    const colours = new Map<string, three.Color>();
    for (const finger of kFingers) {
      const own = new three.Color(kFingerColours[finger]!);
      chainOf(finger).forEach((bone, link) => {
        const joint = Math.min(2, jointAt(finger, link));
        if (joint < 0) return;
        const sensed = pose.fingers[finger].sensed[joint]!;
        const root = finger === 'thumb' && link === 0;
        colours.set(bone, neutral.clone().lerp(own, root ? 0.06 : sensed ? 0.78 : 0.16));
        this.mark(hand.markers.get(bone), sensed ? (quality[finger] ?? 'none') : 'estimated');
      });
    }
    const { geometry, skeleton } = hand.mesh;
    const index = geometry.getAttribute('skinIndex');
    const weight = geometry.getAttribute('skinWeight');
    const paint = new Float32Array(index.count * 3);
    const [mixed, part] = [new three.Color(), new three.Color()];
    for (let v = 0; v < index.count; ++v) {
      mixed.setRGB(0, 0, 0);
      let sum = 0;
      for (let k = 0; k < 4; ++k) {
        const w = weight.getComponent(v, k);
        if (w === 0) continue;
        const colour = colours.get(skeleton.bones[index.getComponent(v, k)]!.name) ?? neutral;
        mixed.add(part.copy(colour).multiplyScalar(w));
        sum += w;
      }
      mixed.multiplyScalar(1 / (sum || 1)).toArray(paint, v * 3);
    }
    geometry.setAttribute('color', new three.Float32BufferAttribute(paint, 3));
  }

  private mark(sprite: three.Sprite | undefined, kind: MarkKind): void {
    if (!sprite) return;
    sprite.material.map = this.textures.get(kind)!;
    sprite.material.opacity = kind === 'estimated' ? 0.75 : 1;
    sprite.material.needsUpdate = true;
    sprite.scale.setScalar(kind === 'estimated' ? 0.009 : 0.0118);
  }

  private draw(two: boolean): void {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement!;
    this.renderer.setScissorTest(false);
    this.renderer.clear();
    this.renderer.setScissorTest(true);
    // Side by side; on a narrow screen the bionic hand goes up beside the fingers.
    const narrow = width < 560;
    const main = two ? Math.round(width * (narrow ? 0.62 : 0.58)) : width;
    const low = narrow ? Math.round(height * 0.24) : 0; // what stands at the bottom stays clear
    this.view(0, 0, low, main, height - low - (narrow ? 20 : 0));
    if (!two) return;
    const tall = narrow ? Math.round(height * 0.46) : height;
    if (narrow) this.view(1, main, height - tall - 28, width - main, tall);
    else this.view(1, main, 28, width - main, height - 28);
  }

  // A hand in a part of the canvas, as large as fits.
  private view(shown: 0 | 1, x: number, y: number, width: number, height: number): void {
    const [tall, wide, lift_rad] = [0.225, 0.15, 0.16];
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    this.camera.aspect = width / height;
    const distance = Math.max(tall / 2 / half, wide / 2 / (half * this.camera.aspect));
    const turn_rad = (this.side === 'left' ? 1 : -1) * (this.yaw_rad - Math.PI / 2) + Math.PI;
    this.camera.position.setFromSphericalCoords(distance, Math.PI / 2 - lift_rad, turn_rad);
    this.camera.lookAt(0, -0.004, 0);
    this.camera.updateProjectionMatrix();
    this.renderer.setViewport(x, y, width, height);
    this.renderer.setScissor(x, y, width, height);
    this.hands.forEach((hand, i) => (hand.visible = i === shown));
    this.renderer.render(this.scene, this.camera);
  }
}
