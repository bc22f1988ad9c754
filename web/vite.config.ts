/** Owns how the page is built, served while it is written, and tested. */
import { defineConfig } from "vitest/config";

const server = process.env.HORNBILL_URL ?? "http://127.0.0.1:8000";

export default defineConfig({
  base: "/",
  esbuild: { jsx: "automatic", jsxImportSource: "preact" },
  build: {
    target: "es2022",
    // Nothing inline: the server's content security policy allows files of its own origin alone.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 300,
  },
  server: {
    host: "127.0.0.1",
    proxy: {
      "/api": { target: server, ws: true },
      "/viser": { target: server, ws: true },
      "/metrics": { target: server },
    },
  },
  test: {
    environment: "happy-dom",
    include: ["src/**/*.test.{ts,tsx}"],
    restoreMocks: true,
    // The contrast test reads the tokens as they are.
    css: { include: [/tokens\.css/] },
  },
});
