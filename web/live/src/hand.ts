// The hand in space: the wearer's, skinned, and beside it the bionic one, of rods. Drawn only when something has changed.
import {
  AmbientLight,
  Bone,
  CanvasTexture,
  Color,
  CylinderGeometry,
  DirectionalLight,
  Float32BufferAttribute,
  Group,
  HemisphereLight,
  Mesh,
  MeshStandardMaterial,
  PerspectiveCamera,
  Scene,
  SkinnedMesh,
  SphereGeometry,
  Sprite,
  SpriteMaterial,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { kFingerColours, kShapes } from './colours';
import { kFingers, restPose, type FingerName, type HandPose } from './mapping';
import { css } from './plots';
import { chainOf, jointAt, Skeleton } from './skeleton';
import type { Quality, Side } from './state';

export type View = 'palm' | 'side' | 'back';
const kYaw_rad: Record<View, number> = { palm: 0.62, side: 1.45, back: 2.75 };

interface Loaded {
  mesh: SkinnedMesh;
  group: Group;
  skeleton: Skeleton;
  bones: Map<string, Bone>;
  markers: Map<string, Sprite>;
  bionic: Bionic;
  bionicGroup: Group;
}

type MarkKind = Quality | 'estimated';

// A mark's picture: its shape says as much as its colour.
function markTexture(kind: MarkKind, dark: boolean): CanvasTexture {
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
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}

const kRod = new CylinderGeometry(1, 1, 1, 20);
const kBall = new SphereGeometry(1, 24, 16);
const kAlongRod = new Vector3(0, 1, 0);

// The other hand's rods and balls, placed by the same skeleton.
class Bionic {
  readonly group = new Group();
  private readonly frame = new MeshStandardMaterial({ roughness: 0.42, metalness: 0.25 });
  private readonly hinge = new MeshStandardMaterial({ roughness: 0.5, metalness: 0.3 });
  private readonly rods: { mesh: Mesh; from: string; to: string }[] = [];
  private readonly balls: { mesh: Mesh; bone: string }[] = [];

  constructor(private readonly skeleton: Skeleton) {
    const rubber = new MeshStandardMaterial({ color: 0x5d6a76, roughness: 0.85 });
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
      row.slice(1).forEach((bone, i) => this.addRod(row[i]!, bone, 0.0042));
    }
    this.addBall('wrist', 0.011, this.hinge);
  }

  setDark(dark: boolean): void {
    this.frame.color.set(dark ? 0xa7b2bd : 0x97a2ad);
    this.hinge.color.set(dark ? 0x5b6874 : 0x39434d);
  }

  apply(pose: HandPose): void {
    this.skeleton.apply(pose);
    const at = (bone: string): Vector3 => new Vector3().setFromMatrixPosition(this.skeleton.world.get(bone)!);
    for (const { mesh, from, to } of this.rods) {
      const [a, b] = [at(from), at(to)];
      mesh.scale.y = a.distanceTo(b);
      mesh.position.lerpVectors(a, b, 0.5);
      mesh.quaternion.setFromUnitVectors(kAlongRod, b.sub(a).normalize());
    }
    for (const { mesh, bone } of this.balls) mesh.position.copy(at(bone));
  }

  private addRod(from: string, to: string, radius: number): void {
    const mesh = new Mesh(kRod, this.frame);
    mesh.scale.set(radius, 1, radius);
    this.group.add(mesh);
    this.rods.push({ mesh, from, to });
  }

  private addBall(bone: string, radius: number, material: MeshStandardMaterial): void {
    const mesh = new Mesh(kBall, material);
    mesh.scale.setScalar(radius);
    this.group.add(mesh);
    this.balls.push({ mesh, bone });
  }
}

export class HandScene {
  readonly canvas: HTMLCanvasElement;
  private readonly renderer: WebGLRenderer;
  private readonly hands = new Scene();
  private readonly bionics = new Scene();
  private readonly camera = new PerspectiveCamera(24, 1, 0.05, 5);
  private readonly loaded = new Map<Side, Loaded>();
  private readonly textures = new Map<MarkKind, CanvasTexture>();
  private side: Side = 'left';
  private pose = restPose();
  private bionicPose: HandPose | null = null;
  private quality: Partial<Record<FingerName, Quality>> = {};
  private painted = '';
  private yaw_rad = kYaw_rad.palm;
  private dirty = true;
  private dark = false;

  // `wanted` is called when there is something new to draw. Throws where the browser has no WebGL.
  constructor(
    private readonly container: HTMLElement,
    private readonly folder: string,
    private readonly wanted: () => void,
  ) {
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true, powerPreference: 'low-power' });
    this.renderer.setPixelRatio(Math.min(2, window.devicePixelRatio));
    this.canvas = this.renderer.domElement;
    for (const scene of [this.hands, this.bionics]) {
      const key = new DirectionalLight(0xffffff, 2.1);
      key.position.set(0.5, 0.9, 1);
      const rim = new DirectionalLight(0xcfe4ff, 0.9);
      rim.position.set(-0.9, 0.4, -0.6);
      scene.add(new HemisphereLight(0xffffff, 0x8a7f78, 1.25), new AmbientLight(0xffffff, 0.25), key, rim);
    }
    const scheme = window.matchMedia('(prefers-color-scheme: dark)');
    this.setDark(scheme.matches);
    scheme.addEventListener('change', () => this.setDark(scheme.matches));
    new ResizeObserver(() => this.resize()).observe(container);
    this.resize();
  }

  async setSide(side: Side): Promise<void> {
    this.side = side;
    if (!this.loaded.has(side)) {
      const found = await this.load(side);
      if (!this.loaded.has(side)) this.loaded.set(side, found);
    }
    for (const [name, { group, bionicGroup }] of this.loaded) group.visible = bionicGroup.visible = name === this.side;
    this.painted = '';
    this.change();
  }

  setPose(pose: HandPose, quality: Partial<Record<FingerName, Quality>>): void {
    this.pose = pose;
    this.quality = quality;
    this.dirty = true;
  }

  setBionic(pose: HandPose | null): void {
    this.bionicPose = pose;
    this.dirty = true;
  }

  setView(view: View): void {
    this.yaw_rad = kYaw_rad[view];
    this.change();
  }

  turn(by_rad: number): void {
    this.yaw_rad += by_rad;
    this.change();
  }

  // True: drawn.
  render(): boolean {
    const hand = this.loaded.get(this.side);
    if (!this.dirty || !hand) return false;
    this.dirty = false;
    hand.skeleton.apply(this.pose);
    this.place(hand);
    this.paint(hand);
    this.draw(hand.bionic);
    return true;
  }

  private change(): void {
    this.dirty = true;
    this.wanted();
  }

  private setDark(dark: boolean): void {
    this.dark = dark;
    for (const kind of ['good', 'fair', 'poor', 'none', 'estimated'] as const) {
      this.textures.get(kind)?.dispose();
      this.textures.set(kind, markTexture(kind, dark));
    }
    for (const { bionic } of this.loaded.values()) bionic.setDark(dark);
    this.painted = '';
    this.change();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.container;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.change();
  }

  private async load(side: Side): Promise<Loaded> {
    const gltf = await new GLTFLoader().loadAsync(`${this.folder}${side}.glb`);
    let mesh: SkinnedMesh | null = null;
    const bones = new Map<string, Bone>();
    gltf.scene.updateMatrixWorld(true);
    gltf.scene.traverse((node) => {
      if (node instanceof SkinnedMesh) mesh = node;
      if (node instanceof Bone) bones.set(node.name, node);
    });
    const skinned = mesh as SkinnedMesh | null;
    if (!skinned) throw new Error(`${side}.glb has no skinned hand`);
    const rest = new Map([...bones].map(([name, bone]) => [name, bone.matrixWorld.clone()] as const));
    skinned.frustumCulled = false;
    skinned.material = new MeshStandardMaterial({ vertexColors: true, roughness: 0.62, metalness: 0 });
    const inner = new Group(); // fingers up, the middle of the hand at the turning axis
    inner.rotation.x = Math.PI;
    inner.position.set(side === 'left' ? 0.03 : -0.03, -0.035, 0);
    inner.add(gltf.scene);
    const group = new Group().add(inner);
    const markers = new Map<string, Sprite>();
    for (const finger of kFingers) {
      for (const bone of chainOf(finger).slice(finger === 'thumb' ? 0 : 1, -1)) {
        const sprite = new Sprite(new SpriteMaterial({ depthTest: false, transparent: true }));
        sprite.renderOrder = 2;
        markers.set(bone, sprite);
        inner.add(sprite);
      }
    }
    this.hands.add(group);
    const bionic = new Bionic(new Skeleton(rest, side === 'right'));
    bionic.group.rotation.copy(inner.rotation);
    bionic.group.position.copy(inner.position);
    bionic.setDark(this.dark);
    const bionicGroup = new Group().add(bionic.group);
    this.bionics.add(bionicGroup);
    const skeleton = new Skeleton(rest, side === 'right');
    return { mesh: skinned, group, skeleton, bones, markers, bionic, bionicGroup };
  }

  // Bones and marks to where the skeleton has them.
  private place(hand: Loaded): void {
    for (const [name, matrix] of hand.skeleton.world) {
      const bone = hand.bones.get(name);
      if (bone) matrix.decompose(bone.position, bone.quaternion, bone.scale);
      hand.markers.get(name)?.position.setFromMatrixPosition(matrix);
    }
    const [pitch, yaw] = this.pose.wrist_deg;
    const side = this.side === 'left' ? 1 : -1;
    hand.group.rotation.set((yaw * Math.PI) / 360, 0, (-side * pitch * Math.PI) / 360);
  }

  // Colours by what is sensed, and marks by quality; only when that has changed.
  private paint(hand: Loaded): void {
    const key = JSON.stringify([this.quality, kFingers.map((f) => this.pose.fingers[f].sensed), this.dark, this.side]);
    if (key === this.painted) return;
    this.painted = key;
    const neutral = new Color(this.dark ? 0xb9bdc4 : 0xe4dcd4);
    const colours = new Map<string, Color>();
    for (const finger of kFingers) {
      const own = new Color(kFingerColours[finger]!);
      chainOf(finger).forEach((bone, link) => {
        const joint = Math.min(2, jointAt(finger, link));
        if (joint < 0) return;
        const sensed = this.pose.fingers[finger].sensed[joint]!;
        const root = finger === 'thumb' && link === 0;
        colours.set(bone, neutral.clone().lerp(own, root ? 0.06 : sensed ? 0.78 : 0.16));
        this.mark(hand.markers.get(bone), sensed ? (this.quality[finger] ?? 'none') : 'estimated');
      });
    }
    const { geometry, skeleton } = hand.mesh;
    const index = geometry.getAttribute('skinIndex');
    const weight = geometry.getAttribute('skinWeight');
    const paint = new Float32Array(index.count * 3);
    const mixed = new Color();
    for (let v = 0; v < index.count; ++v) {
      mixed.setRGB(0, 0, 0);
      let sum = 0;
      for (let k = 0; k < 4; ++k) {
        const w = weight.getComponent(v, k);
        if (w === 0) continue;
        const colour = colours.get(skeleton.bones[index.getComponent(v, k)]!.name) ?? neutral;
        mixed.r += w * colour.r;
        mixed.g += w * colour.g;
        mixed.b += w * colour.b;
        sum += w;
      }
      mixed.multiplyScalar(1 / (sum || 1)).toArray(paint, v * 3);
    }
    geometry.setAttribute('color', new Float32BufferAttribute(paint, 3));
  }

  private mark(sprite: Sprite | undefined, kind: MarkKind): void {
    if (!sprite) return;
    sprite.material.map = this.textures.get(kind)!;
    sprite.material.opacity = kind === 'estimated' ? 0.75 : 1;
    sprite.material.needsUpdate = true;
    sprite.scale.setScalar(kind === 'estimated' ? 0.009 : 0.0118);
  }

  private draw(bionic: Bionic): void {
    const width = this.container.clientWidth;
    const height = this.container.clientHeight;
    const two = this.bionicPose !== null;
    this.renderer.setScissorTest(false);
    this.renderer.clear();
    this.renderer.setScissorTest(true);
    // Side by side; on a narrow screen the bionic hand goes up beside the fingers.
    const narrow = width < 560;
    const main = two ? Math.round(width * (narrow ? 0.62 : 0.58)) : width;
    const low = narrow ? Math.round(height * 0.24) : 0; // what stands at the bottom stays clear
    this.view(this.hands, 0, low, main, height - low - (narrow ? 20 : 0));
    if (!two) return;
    bionic.apply(this.bionicPose!);
    const tall = narrow ? Math.round(height * 0.46) : height;
    if (narrow) this.view(this.bionics, main, height - tall - 28, width - main, tall);
    else this.view(this.bionics, main, 28, width - main, height - 28);
  }

  // A scene in a part of the canvas, as large as fits.
  private view(scene: Scene, x: number, y: number, width: number, height: number): void {
    const aspect = width / height;
    const side = this.side === 'left' ? 1 : -1;
    const tall = 0.225;
    const wide = 0.15;
    const half = Math.tan((this.camera.fov * Math.PI) / 360);
    const distance = Math.max(tall / 2 / half, wide / 2 / (half * aspect));
    this.camera.aspect = aspect;
    const lift = 0.16;
    const turn = this.yaw_rad;
    this.camera.position.set(
      side * distance * Math.cos(turn) * Math.cos(lift),
      distance * Math.sin(lift),
      -distance * Math.sin(turn) * Math.cos(lift),
    );
    this.camera.lookAt(0, -0.004, 0);
    this.camera.updateProjectionMatrix();
    this.renderer.setViewport(x, y, width, height);
    this.renderer.setScissor(x, y, width, height);
    // Lights go with the camera, so that every view is lit as well as the first.
    for (const light of scene.children) {
      if (!(light instanceof DirectionalLight)) continue;
      const key = light.intensity > 1;
      light.position.copy(this.camera.position).normalize();
      light.position.y += key ? 0.7 : 0.2;
      light.position.applyAxisAngle(new Vector3(0, 1, 0), key ? -0.6 : 2.4);
    }
    this.renderer.render(scene, this.camera);
  }
}
