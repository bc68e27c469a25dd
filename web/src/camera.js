// Where to look from. The orbit is kept relative to a point that rides along (or stays), so that
// following a walker and turning around him do not know of each other.
import { PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const FIELD = 30; // degrees, vertical

export class Orbit {
  constructor(canvas, damping) {
    this.eye = new PerspectiveCamera(FIELD);
    this.shot = new PerspectiveCamera(FIELD, 1, 0.05, 90);
    this.controls = new OrbitControls(this.eye, canvas);
    this.controls.enableDamping = damping;
    this.controls.dampingFactor = 0.12;
    this.controls.enablePan = false;
    this.controls.maxPolarAngle = 0.52 * Math.PI;
    this.controls.zoomSpeed = 0.7;
    // A page must still scroll under the finger and under the wheel: up and down belongs to the
    // page, sideways turns, and only two fingers or Ctrl with the wheel zoom.
    canvas.style.touchAction = "pan-y";
    canvas.addEventListener("wheel", (event) => { this.controls.enableZoom = event.ctrlKey || event.metaKey; }, { capture: true });
    canvas.addEventListener("pointerdown", () => { this.controls.enableZoom = true; }, { capture: true });
  }

  /** Stand `distance` metres away, turned by `azimuth` (0 looks from +z), a little above. */
  place(azimuth, distance, height) {
    this.controls.target.set(0, height, 0);
    const polar = 1.36;
    this.eye.position.setFromSphericalCoords(distance, polar, azimuth).add(this.controls.target);
    this.controls.minDistance = 0.25 * distance;
    this.controls.maxDistance = 6 * distance;
    Object.assign(this.shot, { near: 0.01 * distance, far: 30 * distance });
    this.controls.update();
  }

  /** Metres from where it stands to where it looks. */
  get distance() {
    return this.eye.position.distanceTo(this.controls.target);
  }

  /** Turn by keyboard, radians; or come closer by a factor. */
  turn(azimuth, polar, closer = 1) {
    const { target } = this.controls;
    const arm = new Vector3().subVectors(this.eye.position, target);
    const theta = Math.atan2(arm.x, arm.z) + azimuth;
    const phi = Math.min(Math.max(Math.acos(arm.y / arm.length()) + polar, 0.05), this.controls.maxPolarAngle);
    this.eye.position.setFromSphericalCoords(arm.length() * closer, phi, theta).add(target);
    this.controls.update();
  }

  /** The camera for a view of this width / height whose middle is at (x, z) in the world. */
  aim({ x, z }, aspect) {
    this.shot.position.set(this.eye.position.x + x, this.eye.position.y, this.eye.position.z + z);
    this.shot.quaternion.copy(this.eye.quaternion);
    this.shot.aspect = aspect;
    this.shot.zoom = Math.min(1, aspect / 0.75); // a narrow view keeps outstretched arms
    this.shot.updateProjectionMatrix();
    this.shot.updateMatrixWorld();
    return this.shot;
  }

  dispose() {
    this.controls.dispose();
  }
}
