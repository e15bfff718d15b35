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
    rollupOptions: {
      // The page, and beside it the package for other pages, under a name that stays.
      input: { index: "index.html", "mte-slam": "src/client.ts" },
      preserveEntrySignatures: "exports-only",
      output: {
        entryFileNames: (chunk) => (chunk.name === "mte-slam" ? "mte-slam.js" : "assets/[name]-[hash].js"),
      },
    },
  },
  worker: { format: "es" },
  server: { port: 5173, strictPort: false },
});
