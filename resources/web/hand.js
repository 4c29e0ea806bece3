// One hand of OpenXR's 26 joints: a ball at every joint, and a bone that tapers from one to the next.
import * as THREE from "./three.module.min.js";

const FINGERS = ["thumb", "index", "middle", "ring", "little"];
const KINDS = ["metacarpal", "proximal", "intermediate", "distal", "tip"];
const COLOURS = [0xe8a87c, 0xab9a90, 0x6c7683, 0x6c7683]; // measured, inferred, guessed, unknown
const BALL = new THREE.SphereGeometry(1, 24, 16);
const SKIN = COLOURS.map((color) => new THREE.MeshStandardMaterial({ color, roughness: 0.7 }));
const ALONG = new THREE.Vector3(0, 1, 0);

function pairs(joints) {
  const found = [];
  for (const finger of FINGERS) {
    const chain = ["wrist", ...KINDS.map((kind) => `${finger}_${kind}`)].map((name) => joints.indexOf(name))
      .filter((row) => row >= 0);
    for (let k = 1; k < chain.length; k++) found.push([chain[k - 1], chain[k]]);
  }
  return found;
}

export class Hand extends THREE.Group {
  constructor(joints, radii) {
    super();
    this.radii = radii;
    this.balls = radii.map((radius, row) => {
      const ball = new THREE.Mesh(BALL, SKIN[3]);
      ball.scale.setScalar(radius);
      ball.visible = joints[row] !== "palm" && joints[row] !== "wrist";
      this.add(ball);
      return ball;
    });
    this.bones = pairs(joints).map(([from, to]) => {
      // The wrist is thicker than the bones that begin there.
      const root = joints[from] === "wrist" ? radii[to] : radii[from];
      const bone = new THREE.Mesh(new THREE.CylinderGeometry(radii[to], root, 1, 24, 1, true), SKIN[3]);
      this.add(bone);
      return { mesh: bone, from, to };
    });
    this.places = radii.map(() => new THREE.Vector3());
    this.tips = FINGERS.map((finger) => [joints.indexOf(`${finger}_distal`), joints.indexOf(`${finger}_tip`)]);
  }

  // Whether the hand still has the size that it was made with.
  fits(radii) {
    return radii.length === this.radii.length && radii.every((radius, k) => Math.abs(radius / this.radii[k] - 1) < 0.03);
  }

  show(hand) {
    const known = hand.positions.map((place, row) => {
      if (place) this.places[row].fromArray(place);
      return place !== null;
    });
    for (const [distal, tip] of this.tips) { // a tip is the skin's end, so that its ball lies before it
      const back = this.places[distal].clone().sub(this.places[tip]).setLength(this.radii[tip]);
      this.places[tip].add(back);
    }
    this.balls.forEach((ball, row) => {
      ball.position.copy(this.places[row]);
      ball.material = SKIN[hand.knowledge[row]];
      ball.scale.setScalar(known[row] ? this.radii[row] : 1e-6);
    });
    for (const { mesh, from, to } of this.bones) {
      const step = this.places[to].clone().sub(this.places[from]);
      mesh.visible = known[from] && known[to] && step.lengthSq() > 0;
      if (!mesh.visible) continue;
      mesh.position.copy(this.places[from]).addScaledVector(step, 0.5);
      mesh.scale.set(1, step.length(), 1);
      mesh.quaternion.setFromUnitVectors(ALONG, step.normalize());
      mesh.material = SKIN[Math.max(hand.knowledge[from], hand.knowledge[to])];
    }
    this.visible = known.some(Boolean);
  }

  // The middle of the hand as it was last shown.
  middle(out) {
    out.set(0, 0, 0);
    for (const place of this.places) out.add(place);
    return out.divideScalar(this.places.length);
  }

  dispose() {
    for (const { mesh } of this.bones) mesh.geometry.dispose();
  }
}
