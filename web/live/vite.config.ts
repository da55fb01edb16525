import { existsSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { defineConfig, type Plugin } from 'vite';

const here = fileURLToPath(new URL('.', import.meta.url));

const require = createRequire(import.meta.url);

// The model that script/hand_landmarker makes. Without it the page has no markerless reference, and carries nothing of it; nor in
// the Python wheel, of which model and program would be the larger part.
const model = resolve(here, '../../build/markerless/hand_landmarker.task');
const hasModel = process.env['FLEXOR_MARKERLESS'] !== 'OFF' && existsSync(model);

// Beside what Vite builds: of npm's `@webxr-input-profiles/assets` one hand, and nothing else of its 93 MB; and what is loaded
// only when somebody chooses the markerless reference: the program that runs the model, for processors with SIMD, which every
// browser of today has.
const carried = {
  'hand.glb': require.resolve('@webxr-input-profiles/assets/dist/profiles/generic-hand/right.glb'),
  ...(hasModel && {
    'markerless/vision.js': require.resolve('@mediapipe/tasks-vision/vision_wasm_module_internal.js'),
    'markerless/vision.wasm': require.resolve('@mediapipe/tasks-vision/vision_wasm_module_internal.wasm'),
    'markerless/hand_landmarker.task': model,
  }),
};
const carry: Plugin = {
  name: 'carry',
  generateBundle() {
    for (const [fileName, file] of Object.entries(carried))
      this.emitFile({ type: 'asset', fileName, source: readFileSync(file) });
  },
};

export default defineConfig({
  root: here,
  base: './', // the page lies at /TOKEN/, which no build knows
  plugins: [carry],
  define: { __MARKERLESS__: JSON.stringify(hasModel) },
  worker: { format: 'es', rollupOptions: { output: { entryFileNames: 'markerless/[name].js' } } },
  build: {
    outDir: resolve(process.env['FLEXOR_PAGE_OUT'] ?? `${here}/dist`),
    emptyOutDir: true,
    target: 'es2022',
    assetsInlineLimit: 0, // the Content-Security-Policy allows no data: but for pictures
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 700,
    rollupOptions: {
      output: {
        entryFileNames: 'assets/[name].js',
        chunkFileNames: 'assets/[name].js',
        assetFileNames: 'assets/[name][extname]',
      },
    },
  },
});
