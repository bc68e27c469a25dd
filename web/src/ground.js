// The floor: a grid that fades with distance and is as wide as one can see, because it travels with
// the camera's target while its lines stay where they are in the world.
import { Color, Group, Mesh, PlaneGeometry, ShaderMaterial, ShadowMaterial } from "three";

export const LINES = 0.5; // metres from line to line; every second one is strong
const RADIUS = 14; // metres until the floor has faded

const vertexShader = `
  varying vec3 world;
  void main() {
    vec4 at = modelMatrix * vec4(position, 1.0);
    world = at.xyz;
    gl_Position = projectionMatrix * viewMatrix * at;
  }`;

const fragmentShader = `
  varying vec3 world;
  uniform vec3 middle, floorColor, lineColor;
  float line(vec2 at, float width) {          // anti-aliased: one pixel stays one pixel
    vec2 pixel = max(fwidth(at), vec2(1e-5));
    vec2 distance = abs(fract(at - 0.5) - 0.5);
    vec2 cover = 1.0 - smoothstep(vec2(width), vec2(width) + 1.5 * pixel, distance);
    cover *= clamp(0.35 / pixel, 0.0, 1.0);     // too fine to see: fade instead of flicker
    return max(cover.x, cover.y);
  }
  void main() {
    float reach = length(world.xz - middle.xz) / ${RADIUS.toFixed(1)};
    float fade = 1.0 - smoothstep(0.15, 1.0, reach);
    float grid = max(0.38 * line(world.xz * ${(1 / LINES).toFixed(1)}, 0.004), line(world.xz * ${(0.5 / LINES).toFixed(1)}, 0.006));
    gl_FragColor = vec4(mix(floorColor, lineColor, grid), fade);
    #include <colorspace_fragment>
  }`;

export class Ground extends Group {
  constructor() {
    super();
    const plane = new PlaneGeometry(2 * RADIUS, 2 * RADIUS).rotateX(-Math.PI / 2);
    this.grid = new ShaderMaterial({
      vertexShader,
      fragmentShader,
      transparent: true,
      depthWrite: false,
      uniforms: {
        middle: { value: this.position },
        floorColor: { value: new Color() },
        lineColor: { value: new Color() },
      },
    });
    this.shadow = new ShadowMaterial({ depthWrite: false });
    const floor = new Mesh(plane, this.grid);
    const shadow = new Mesh(plane, this.shadow);
    shadow.receiveShadow = true;
    // Painted in this order below everything else, so nothing has to hover to be seen.
    floor.renderOrder = -3;
    shadow.renderOrder = -2;
    this.add(floor, shadow);
  }

  paint({ floor, line, shadow }) {
    this.grid.uniforms.floorColor.value.set(floor);
    this.grid.uniforms.lineColor.value.set(line);
    this.shadow.opacity = shadow;
  }
}
