// One renderer, one light and one floor for all players of a page. Browsers keep about sixteen WebGL
// contexts and drop the oldest without asking; a chapter may hold more players than that. So players
// take turns on this stage, and each shows the picture on a plain canvas of its own, as long as it is
// seen: a picture costs some megabytes, and so does a stage on which nobody stands.
import { DirectionalLight, Group, HemisphereLight, PCFShadowMap, Scene, WebGLRenderer } from "three";
import { Ground } from "./ground.js";

const SHARED = "__motionlab_stage_2"; // widgets load this module once each
const IDLE = 30_000; // milliseconds without a player in sight, after which the stage goes

/** The page's stage, for a player who comes into view; null where WebGL is missing. */
export function sharedStage(player) {
  if (globalThis[SHARED] === undefined || globalThis[SHARED]?.gone) {
    const gl = begin();
    globalThis[SHARED] = gl && new Stage(gl);
  }
  globalThis[SHARED]?.players.add(player);
  return globalThis[SHARED];
}

class Stage {
  constructor({ canvas, software, ...context }) {
    this.software = software;
    this.players = new Set(); // who are seen
    this.kept = new Set(); // programs
    this.gone = false; // then there will be another; a browser, too, may take it away
    canvas.addEventListener("webglcontextlost", () => { this.gone = true; });
    this.renderer = new WebGLRenderer({ canvas, ...context });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.scene = new Scene();
    this.cast = new Group(); // the figures of the player whose turn it is
    this.ground = new Ground();
    this.sky = new HemisphereLight("#ffffff", "#9c9488", 1);
    this.sun = new DirectionalLight("#fff9f0", 3.1);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.setScalar(this.software ? 512 : 1024);
    this.sun.shadow.radius = 4;
    this.sun.shadow.bias = -0.0004;
    this.sun.shadow.normalBias = 0.012;
    this.rim = new DirectionalLight("#cfe0ff", 0.9);
    this.scene.add(this.cast, this.ground, this.sky, this.sun, this.sun.target, this.rim, this.rim.target);
  }

  /**
   * Draw views onto a canvas. Each view: {actors, aim, middle, floor, spread, azimuth, x, y, width, height},
   * a rectangle in CSS pixels with y down; `aim()` gives its camera, `middle` is where floor and light go, `spread` the
   * metres around it that cast shadows, `azimuth` the side the sun is on.
   */
  draw(canvas, views, theme, ratio) {
    const width = canvas.width / ratio;
    const height = canvas.height / ratio;
    this.resize(width, height, ratio);
    this.ground.paint(theme);
    this.sky.intensity = theme.sky;
    this.rim.intensity = theme.rim;
    this.renderer.setScissorTest(false); // rounding may leave a column between views: wipe it, too
    this.renderer.clear();
    this.renderer.setScissorTest(true);
    for (const view of views) {
      this.cast.clear();
      this.cast.add(...view.actors);
      this.light(view);
      const bottom = height - view.y - view.height;
      this.renderer.setViewport(view.x, bottom, view.width, view.height);
      this.renderer.setScissor(view.x, bottom, view.width, view.height);
      this.renderer.render(this.scene, view.aim());
    }
    this.keepPrograms();
    hand(this.renderer.domElement, canvas);
  }

  /** Once, and only if there is need: each time the browser makes another buffer. */
  resize(width, height, ratio) {
    const size = [width, height, ratio].join();
    if (size !== this.size) this.renderer.setDrawingBufferSize(width, height, ratio);
    this.size = size;
  }

  /** Shaders stay as long as the stage: the next figure needs the same ones, and to make them anew may take a second. */
  keepPrograms() {
    for (const program of this.renderer.info.programs) {
      if (this.kept.has(program)) continue;
      this.kept.add(program);
      program.usedTimes++; // three lets go of what nobody uses
    }
  }

  /** A player is seen no more, and needs no picture; if nobody is for a while, the stage goes. */
  leave(player, canvas) {
    if (!this.players.delete(player)) return;
    this.cast.clear();
    canvas.width = canvas.height = 1;
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.players.size || this.close(), IDLE);
  }

  close() {
    this.gone = true;
    this.renderer.dispose();
    this.renderer.forceContextLoss(); // else it is kept until memory is collected
  }

  /** The sun stands to the left of the first view, the rim light opposite; both travel along. */
  light({ middle, floor, spread, azimuth }) {
    this.ground.position.set(middle.x, floor, middle.z);
    for (const [lamp, turn, away, height] of [[this.sun, -0.75, 3.6, 5], [this.rim, 2.6, 5, 3]]) {
      lamp.target.position.set(middle.x, 0.6, middle.z);
      const angle = azimuth + turn;
      lamp.position.set(middle.x + away * Math.sin(angle), height, middle.z + away * Math.cos(angle));
    }
    const box = this.sun.shadow.camera;
    if (box.right !== spread) {
      Object.assign(box, { left: -spread, right: spread, top: spread, bottom: -spread, near: 0.5, far: 14 + spread });
      box.updateProjectionMatrix();
    }
  }
}

/** Show a picture on a canvas of the page: handed over, which takes less memory than a copy, or copied. */
function hand(picture, canvas) {
  if (picture.transferToImageBitmap) return canvas.getContext("bitmaprenderer").transferFromImageBitmap(picture.transferToImageBitmap());
  const brush = canvas.getContext("2d");
  brush.clearRect(0, 0, canvas.width, canvas.height);
  brush.drawImage(picture, 0, 0);
}

/**
 * What a renderer draws with: {canvas, context, antialias, software}; null where WebGL is missing. Pictures drawn by
 * the processor (no graphics card) have to do with fewer pixels. A context costs megabytes: they get the first one.
 */
function begin() {
  const [canvas, context] = started(false) ?? [];
  if (!context) return null;
  const info = context.getExtension("WEBGL_debug_renderer_info"); // null if the browser keeps it secret
  const software = /swiftshader|llvmpipe|software|basic render/i.test(info ? context.getParameter(info.UNMASKED_RENDERER_WEBGL) : "");
  if (software) return { canvas, context, software };
  const [smooth, its] = started(true) ?? [canvas, context];
  if (its !== context) context.getExtension("WEBGL_lose_context")?.loseContext();
  return { canvas: smooth, context: its, software };
}

/** A canvas, one whose picture can be handed over if the browser draws on such, and its context; null if it has none. */
function started(antialias) {
  const kinds = [() => globalThis.OffscreenCanvas && new OffscreenCanvas(1, 1), () => document.createElement("canvas")];
  for (const kind of kinds) {
    const canvas = kind();
    const context = canvas?.getContext("webgl2", { antialias, alpha: true, depth: true, powerPreference: "low-power" });
    if (context) return [canvas, context];
  }
  return null;
}
