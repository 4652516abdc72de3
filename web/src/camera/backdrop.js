// The live picture behind the content, without the distortion of its lens, which content is drawn without, too.
import { BufferAttribute, BufferGeometry, Camera, CanvasTexture, LinearFilter, Mesh, Scene, ShaderMaterial, Vector2, Vector4 } from "three";

const VERTEX = `
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;
// The models of lenses are those of OpenCV (docs/formats.md). Pixel centres of the image are at integer coordinates.
const FRAGMENT = `
uniform sampler2D map;
uniform vec4 area;    // of the image on the canvas: its lower left corner and its size, in drawn pixels
uniform vec2 size;    // of the image, in its pixels
uniform vec4 lens;    // fx, fy, cx, cy
uniform float k[5];
uniform bool isFisheye;
void main() {
  vec2 at = (gl_FragCoord.xy - area.xy) / area.zw;
  vec2 p = (vec2(at.x, 1.0 - at.y) * size - 0.5 - lens.zw) / lens.xy;
  float r2 = dot(p, p);
  if (isFisheye) {
    float r = sqrt(r2);
    float a = atan(r);
    float a2 = a * a;
    p *= r > 1e-6 ? a * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / r : 1.0;
  } else {
    float xy = 2.0 * p.x * p.y;
    p = p * (1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4])))
      + vec2(k[2] * xy + k[3] * (r2 + 2.0 * p.x * p.x), k[2] * (r2 + 2.0 * p.y * p.y) + k[3] * xy);
  }
  vec2 uv = (p * lens.xy + lens.zw + 0.5) / size;
  bool isInside = all(greaterThanEqual(uv, vec2(0.0))) && all(lessThanEqual(uv, vec2(1.0)));
  gl_FragColor = isInside ? vec4(texture2D(map, vec2(uv.x, 1.0 - uv.y)).rgb, 1.0) : vec4(0.0, 0.0, 0.0, 1.0);
}`;

export class Backdrop {
  /** @type {CanvasTexture | null} */ next = null; // has the image that is shown next, once its pose is known
  size = ""; // of the images

  constructor() {
    this.uniforms = {
      map: { value: /** @type {CanvasTexture | null} */ (null) }, area: { value: new Vector4() }, size: { value: new Vector2() }, lens: { value: new Vector4() },
      k: { value: [0, 0, 0, 0, 0] }, isFisheye: { value: false },
    };
    // One triangle that covers the canvas.
    const triangle = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    this.mesh = new Mesh(triangle, new ShaderMaterial({ uniforms: this.uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT, depthTest: false, depthWrite: false }));
    this.mesh.frustumCulled = false;
    this.scene = new Scene();
    this.scene.add(this.mesh);
    this.camera = new Camera();
  }

  // Keeps the image on a canvas, which is drawn over afterwards, to be shown later.
  take(renderer, canvas) {
    const size = `${canvas.width}x${canvas.height}`;
    if (size !== this.size) {
      this.size = size;
      for (const texture of [this.next, this.uniforms.map.value]) texture?.dispose();
      this.next = this.uniforms.map.value = null;
    }
    this.next ??= Object.assign(new CanvasTexture(canvas), { minFilter: LinearFilter, magFilter: LinearFilter, generateMipmaps: false });
    this.next.image = canvas;
    this.next.needsUpdate = true;
    renderer.initTexture(this.next);
  }

  // Shows the image that was taken last.
  change() {
    [this.next, this.uniforms.map.value] = [this.uniforms.map.value, this.next];
  }

  // `area`: where the image is on an element of this height; `ratio`: drawn pixels in a pixel of the element.
  render(renderer, area, height, ratio) {
    this.cover(area, height, ratio);
    if (this.uniforms.map.value) renderer.render(this.scene, this.camera);
  }

  // Puts the image there when `mesh` is drawn next.
  cover(area, height, ratio) {
    const { camera, scale, offset } = area;
    const { uniforms } = this;
    const [w, h] = [camera.width * scale, camera.height * scale];
    uniforms.area.value.set(offset[0], height - offset[1] - h, w, h).multiplyScalar(ratio);
    uniforms.size.value.set(camera.width, camera.height);
    uniforms.lens.value.set(camera.fx, camera.fy, camera.cx, camera.cy);
    uniforms.isFisheye.value = camera.model === "fisheye";
    uniforms.k.value = [0, 1, 2, 3, 4].map((i) => camera.distortion?.[i] ?? 0);
  }
}
