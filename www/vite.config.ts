import { defineConfig } from "vite";

export default defineConfig({
  // Relative addresses: the built page works from any sub-path.
  base: "./",
  build: {
    target: "es2022",
    outDir: "dist",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 300,
  },
  worker: { format: "es" },
  server: { port: 5173, strictPort: false },
});
