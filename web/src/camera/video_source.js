const WANTED = { facingMode: { ideal: "environment" }, width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 30 } };
const QUALITY = 0.7; // of JPEG

/** The device's camera: its live picture, and the time of each of its images. */
export class VideoSource {
  /** @type {MediaStreamTrack | undefined} */ track;
  /** @type {string | null} */ clock = null; // where the times of images come from: the sources differ by an offset
  picture = contextOf(false); // the image as it is shown
  small = contextOf(true); // the image as it is tracked and sent
  last = 0; // time of an image

  /** `onFrame` gets the time of each image, in seconds on the clock of performance.now(). @param {HTMLVideoElement} video  @param {{ onFrame: (time: number) => void, onEnded: () => void }} events */
  constructor(video, { onFrame, onEnded }) {
    this.video = video;
    this.onFrame = onFrame;
    this.onEnded = onEnded;
  }

  // Throws what getUserMedia throws.
  async open() {
    this.close();
    const stream = await navigator.mediaDevices.getUserMedia({ audio: false, video: WANTED });
    [this.track] = stream.getVideoTracks();
    this.track.addEventListener("ended", () => this.onEnded());
    this.clock = null;
    this.video.srcObject = stream;
    await this.video.play();
    this.watch(stream);
  }

  close() {
    if (this.video.srcObject instanceof MediaStream) this.video.srcObject.getTracks().forEach((track) => track.stop());
    this.video.srcObject = null;
  }

  get isOpen() {
    return this.track?.readyState === "live" && this.size.width > 0;
  }

  get size() {
    return { width: this.video.videoWidth, height: this.video.videoHeight };
  }

  get isFront() {
    return this.track?.getSettings().facingMode === "user";
  }

  // What identifies a lens, and how the device is held.
  get lens() {
    return { label: this.track?.label, deviceId: this.track?.getSettings().deviceId, ...this.size };
  }

  watch(stream) {
    const { video } = this;
    const next = (act) => (video.requestVideoFrameCallback ? video.requestVideoFrameCallback(act) : requestAnimationFrame((now) => act(now, {})));
    const step = (now, metadata) => {
      if (video.srcObject !== stream) return;
      next(step);
      this.clock ??= ["captureTime", "presentationTime"].find((key) => metadata[key] > 0) ?? "now";
      const time = (metadata[this.clock] ?? now) / 1000;
      if (time <= this.last || !this.isOpen) return;
      this.last = time;
      this.onFrame(time);
    };
    next(step);
  }

  // Takes the present image in a size: all of its uses are of the same image, while the video goes on.
  grab({ width, height }) {
    const { video, picture, small } = this;
    const isWhole = width === this.size.width && height === this.size.height;
    if (!isWhole) draw(picture, video, this.size);
    draw(small, isWhole ? video : picture.canvas, { width, height });
    return { image: small.getImageData(0, 0, width, height), canvas: isWhole ? small.canvas : picture.canvas };
  }

  // The image that was taken last, as the bytes of a JPEG.
  async jpeg() {
    /** @type {Blob | null} */
    const blob = await new Promise((resolve) => this.small.canvas.toBlob(resolve, "image/jpeg", QUALITY));
    return new Uint8Array((await blob?.arrayBuffer()) ?? []);
  }
}

/** @returns {CanvasRenderingContext2D} */
function contextOf(willReadFrequently) {
  return /** @type {CanvasRenderingContext2D} */ (document.createElement("canvas").getContext("2d", { alpha: false, willReadFrequently }));
}

/** @param {CanvasRenderingContext2D} context */
function draw(context, image, { width, height }) {
  const { canvas } = context;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  context.drawImage(image, 0, 0, width, height);
}
