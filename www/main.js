// Shows what this build is and whether the browser can run it.

const show = (id, text, good = true) => {
  const place = document.getElementById(id);
  place.textContent = text;
  place.classList.toggle("bad", !good);
};

async function loadPackage() {
  try {
    // Imported here and not at the top, so that a missing package is a message, not a blank page.
    const mte = await import("./pkg/mte_slam_web.js");
    await mte.default();
    show("version", mte.version());
    show("camera", mte.describe_camera(1200, 680, 600, 600, 599.5, 339.5));
  } catch (error) {
    show("version", `the WebAssembly package did not load: ${error.message ?? error}`, false);
    show("camera", "not available", false);
  }
}

async function findAdapter() {
  if (!window.isSecureContext) {
    return show("webgpu", "needs https:// or http://localhost", false);
  }
  if (!navigator.gpu) {
    return show("webgpu", "not in this browser; the CPU engine will be used", false);
  }
  try {
    const adapter = await navigator.gpu.requestAdapter({ powerPreference: "high-performance" });
    if (!adapter) {
      return show("webgpu", "no adapter on this machine; the CPU engine will be used", false);
    }
    const { vendor, architecture, description } = adapter.info ?? {};
    const name = [description, vendor, architecture].filter(Boolean).join(", ");
    show("webgpu", name ? `yes: ${name}` : "yes");
  } catch (error) {
    show("webgpu", `asking for an adapter failed: ${error.message ?? error}`, false);
  }
}

await Promise.all([loadPackage(), findAdapter()]);
