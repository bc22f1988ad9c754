/** How the page is built, served while it is written, and tested. */
import type { Plugin, Rollup } from "vite";
import { defineConfig } from "vitest/config";

const server = process.env.HORNBILL_URL ?? "http://127.0.0.1:8000";

/** Lets the browser fetch the page, its style and font while it still fetches the language, which the page waits for. */
const startEarly: Plugin = {
  name: "start-early",
  apply: "build",
  transformIndexHtml: {
    order: "post",
    handler(html, { bundle }) {
      const start = Object.values(bundle ?? {}).find(file => file.type === "chunk" && file.name === "start");
      if (start?.type !== "chunk") throw new Error("There is no chunk of the name start.");
      const files = [start.fileName, ...start.imports].filter(file => !html.includes(file));
      const font = Object.keys(bundle ?? {}).find(file => file.endsWith(".woff2"));
      if (font === undefined) throw new Error("There is no font.");
      return [
        { rel: "preload", as: "font", type: "font/woff2", crossorigin: "", href: `./${font}` },
        ...files.map(file => ({ rel: "modulepreload", href: `./${file}` })),
        ...[...(start.viteMetadata?.importedCss ?? [])].map(file => ({
          rel: "stylesheet",
          href: `./${file}`,
        })),
      ].map(attrs => ({ tag: "link", attrs, injectTo: "head" as const }));
    },
  },
};

/** Scripts of the start, each with the module whose static imports it contains, and the words of the start. */
const STARTS = { index: "main.tsx", start: "start.tsx", en: "text/en.ts", ja: "text/ja.ts" } as const;
/** Parts of a page that can fail without it, each in its own script. */
const ALONE = ["angle-plot", "live"];
/** Scripts by folder, from below. */
const FOLDERS: Readonly<Record<string, string>> = {
  telemetry: "kit",
  bench: "kit",
  kit: "kit",
  plots: "plots",
  change: "parts",
  view3d: "parts",
  servo: "parts",
  motion: "moves",
  servos: "list",
};

/** Script of each module of the start; empty until the first question. */
const atStart = new Map<string, string>();

/**
 * The script of a module, or undefined for a page, which has its own. The browser loads all parts of the page while it
 * is idle: a hundred small files take it twice as long as a few.
 */
const scriptOf: Rollup.GetManualChunk = (id, { getModuleInfo, getModuleIds }) => {
  for (const [script, module] of atStart.size === 0 ? Object.entries(STARTS) : []) {
    const next = [...getModuleIds()].filter(one => one.endsWith(`/src/${module}`));
    for (let one = next.pop(); one !== undefined; one = next.pop()) {
      if (atStart.has(one)) continue;
      atStart.set(one, script);
      next.push(...(getModuleInfo(one)?.importedIds ?? []));
    }
  }
  const path = id.split("/src/").at(-1) ?? id;
  const language = /\.(en|ja)\.ts$/.exec(path)?.[1] ?? /^text\/(ja)\//.exec(path)?.[1];
  const [folder = "", file = ""] = path.split(/[/.]/);
  if (atStart.has(id)) return atStart.get(id);
  if (id.includes("/node_modules/uplot/")) return "plots";
  if (language !== undefined) return `words.${language}`;
  if (ALONE.includes(file)) return file;
  return file === "page" ? undefined : FOLDERS[folder];
};

/** The folder of a page's module, or undefined. */
const pageFolder = (file: string | null) => /\b(\w+)\/page\.\w+$/.exec(file ?? "")?.[1];

export default defineConfig({
  // The server puts its own path in the place of the dot: it may be shown below any, by a proxy.
  base: "./",
  plugins: [startEarly],
  esbuild: { jsx: "automatic", jsxImportSource: "preact" },
  build: {
    target: "es2022",
    // Nothing inline: the server's content security policy allows files of its own origin alone.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 300,
    rollupOptions: {
      output: {
        manualChunks: scriptOf,
        onlyExplicitManualChunks: true,
        // Scripts and sheets of a page have the name of its folder; every page is called page.tsx.
        chunkFileNames: ({ name, facadeModuleId }) =>
          `assets/${pageFolder(facadeModuleId) ?? name}-[hash].js`,
        assetFileNames: ({ originalFileNames }) =>
          `assets/${pageFolder(originalFileNames[0] ?? null) ?? "[name]"}-[hash][extname]`,
      },
    },
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
    // One document for the files of a worker; clean.ts gives each file an empty one, and its own modules.
    pool: "threads",
    isolate: false,
    // A test that loads modules takes long on a busy machine.
    testTimeout: 60_000,
    hookTimeout: 60_000,
    setupFiles: ["src/testing/clean.ts", "src/text/setup.ts"],
    // The contrast test reads the tokens as they are.
    css: { include: [/tokens\.css/] },
  },
});
