import { defineConfig } from "vite";

// `vite build` makes the page; `vite build --mode package` what npm's package holds: the session and
// its worker, without the page.
export default defineConfig(({ mode }) => ({
  // Relative addresses: the built page works from any sub-path.
  base: "./",
  publicDir: mode === "package" ? false : "public",
  build: {
    target: "es2022",
    outDir: mode === "package" ? "lib" : "dist",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 300,
    rollupOptions: {
      // The page, and beside it the package for other pages, under a name that stays.
      input: { ...(mode === "package" ? {} : { index: "index.html" }), "mte-slam": "src/client.ts" },
      preserveEntrySignatures: "exports-only",
      output: {
        entryFileNames: (chunk) => (chunk.name === "mte-slam" ? "mte-slam.js" : "assets/[name]-[hash].js"),
      },
    },
  },
  worker: { format: "es" },
  server: { port: 5173, strictPort: false },
}));
