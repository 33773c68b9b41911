// Writes src/gen/reasons.ts: of each reason in the contract's reasons.json, its code, whether it means that a simulation
// diverged, and what to do. `npm run gen` runs it.

import { readFileSync, writeFileSync } from 'node:fs';

const rows = JSON.parse(readFileSync(new URL('../../../proto/nappe/v1/reasons.json', import.meta.url), 'utf8'));
const quoted = (text) => `'${text.replaceAll('\\', '\\\\').replaceAll("'", "\\'")}'`;
const line = ({ reason, code, is_divergence, remedy }) =>
  `  ${reason}: { code: ${quoted(code)}, isDivergence: ${is_divergence}, remedy: ${quoted(remedy)} },\n`;

const head = `// Why a call can fail, and what to do. Made from proto/nappe/v1/reasons.json by tools/reasons.mjs; do not edit.

export const REASONS = {
`;
const text = `${head}${rows.map(line).join('')}} as const;\n`;
writeFileSync(new URL('../src/gen/reasons.ts', import.meta.url), text);
