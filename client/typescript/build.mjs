// Builds dist, from which programs import the package: `npm run build`.

import { build } from 'esbuild';

await build({
  entryPoints: ['src/index.ts', 'src/packed.ts'],
  absWorkingDir: import.meta.dirname ?? new URL('.', import.meta.url).pathname,
  bundle: true,
  packages: 'external',
  outdir: 'dist',
  format: 'esm',
  target: 'es2022',
});
