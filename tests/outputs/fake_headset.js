// A headset that is none: navigator.xr with one session at a time, whose eyes are drawn side by side into the canvas.
(() => {
  const matrix = (x) => new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, 0, 0, 1]);
  const projection = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1.002, -1, 0, 0, -0.2002, 0]);
  const transform = (x) => ({ matrix: matrix(x), inverse: { matrix: matrix(-x) },
    position: { x, y: 0, z: 0, w: 1 }, orientation: { x: 0, y: 0, z: 0, w: 1 } });
  const views = [-0.03, 0.03].map((x, k) => ({ eye: k ? "right" : "left", projectionMatrix: projection,
    transform: transform(x) }));
  window.fakeHeadset = { session: null, mode: "", drawn: 0 };

  class Session extends EventTarget {
    constructor() {
      super();
      Object.assign(this, { renderState: { depthNear: 0.1, depthFar: 100, baseLayer: null }, inputSources: [],
        enabledFeatures: ["local"], environmentBlendMode: "opaque", visibilityState: "visible", ended: false });
    }
    updateRenderState(state) { Object.assign(this.renderState, state); }
    async requestReferenceSpace() { return new EventTarget(); }
    requestAnimationFrame(call) {
      return setTimeout(() => {
        if (this.ended) return;
        call(performance.now(), { session: this, getViewerPose: () => ({ transform: transform(0), views,
          emulatedPosition: false }), getPose: () => null });
        this.look();
      }, 16);
    }
    cancelAnimationFrame(number) { clearTimeout(number); }
    async end() { this.ended = true; window.fakeHeadset.session = null; this.dispatchEvent(new Event("end")); }
    // How many pixels are bright: the background is not, the hand is.
    look() {
      const gl = this.renderState.baseLayer.gl;
      const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
      const pixels = new Uint8Array(4 * width * height);
      gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      let bright = 0;
      for (let k = 0; k < pixels.length; k += 4) bright += pixels[k] > 120;
      window.fakeHeadset.drawn = bright;
    }
  }

  window.XRWebGLBinding = undefined;
  window.XRWebGLLayer = class {
    constructor(_session, gl) { Object.assign(this, { gl, framebuffer: null,
      framebufferWidth: gl.drawingBufferWidth, framebufferHeight: gl.drawingBufferHeight }); }
    getViewport(view) {
      const width = this.framebufferWidth / 2;
      return { x: view.eye === "left" ? 0 : width, y: 0, width, height: this.framebufferHeight };
    }
    static getNativeFramebufferScaleFactor() { return 1; }
  };
  WebGL2RenderingContext.prototype.makeXRCompatible = async () => {};
  Object.defineProperty(navigator, "xr", { configurable: true, value: Object.assign(new EventTarget(), {
    isSessionSupported: async (mode) => mode === "immersive-vr",
    requestSession: async (mode) => {
      Object.assign(window.fakeHeadset, { session: new Session(), mode });
      return window.fakeHeadset.session;
    } }) });
})();
