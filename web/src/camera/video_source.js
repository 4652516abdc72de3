// The device's camera: its live picture, and the moment of each of its images.
const WANTED = { facingMode: { ideal: "environment" }, width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 30 } };
const QUALITY = 0.7; // of JPEG

export class VideoSource {
  // `onFrame` gets the time of each image, in seconds on the clock of performance.now().
  constructor(video, { onFrame, onEnded }) {
    Object.assign(this, { video, onFrame, onEnded });
    this.canvas = document.createElement("canvas");
    this.last = 0;
  }

  // Throws what getUserMedia throws.
  async open() {
    this.close();
    const stream = await navigator.mediaDevices.getUserMedia({ audio: false, video: WANTED });
    [this.track] = stream.getVideoTracks();
    this.track.onended = () => this.onEnded();
    this.clock = null;
    this.video.srcObject = stream;
    await this.video.play();
    this.watch(stream);
  }

  close() {
    this.video.srcObject?.getTracks().forEach((track) => track.stop());
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

  // What tells one lens, and one way to hold it, from another.
  get lens() {
    return { label: this.track.label, deviceId: this.track.getSettings().deviceId, ...this.size };
  }

  watch(stream) {
    const { video } = this;
    const next = (act) => (video.requestVideoFrameCallback ? video.requestVideoFrameCallback(act) : requestAnimationFrame((now) => act(now, {})));
    const step = (now, metadata) => {
      if (video.srcObject !== stream) return;
      next(step);
      // The same clock throughout: they differ.
      this.clock ??= ["captureTime", "presentationTime"].find((key) => metadata[key] > 0) ?? "now";
      const time = (metadata[this.clock] ?? now) / 1000;
      if (time <= this.last || !this.isOpen) return;
      this.last = time;
      this.onFrame(time);
    };
    next(step);
  }

  // The image of now in a size, as the bytes of a JPEG.
  async jpeg({ width, height }) {
    const { canvas } = this;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    this.context ??= canvas.getContext("2d", { alpha: false });
    this.context.drawImage(this.video, 0, 0, width, height);
    const blob = await new Promise((resolve) => canvas.toBlob(resolve, "image/jpeg", QUALITY));
    return new Uint8Array(await blob.arrayBuffer());
  }
}
