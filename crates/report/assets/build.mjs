// Makes what the page embeds from the locked packages; never part of `cargo build`.
import { build } from 'esbuild';
import { createHash } from 'node:crypto';
import { readFileSync, writeFileSync } from 'node:fs';

await build({
  entryPoints: ['replay.entry.js'], bundle: true, minify: true, format: 'iife', globalName: 'T3', legalComments: 'none',
  target: 'es2022', outfile: 'replay.min.js',
});
const modules = 'node_modules';
writeFileSync('uplot.min.js', readFileSync(`${modules}/uplot/dist/uPlot.iife.min.js`));
writeFileSync('uplot.css', readFileSync(`${modules}/uplot/dist/uPlot.min.css`));
const licence = (name) => {
  const { version, license, homepage } = JSON.parse(readFileSync(`${modules}/${name}/package.json`));
  return `${name} ${version} (${license}), ${homepage}\n\n${readFileSync(`${modules}/${name}/LICENSE`)}`;
};
writeFileSync('LICENSES', ['uplot', 'three'].map(licence).join('\n----\n\n'));
const made = ['uplot.min.js', 'uplot.css', 'replay.min.js', 'LICENSES'];
const sum = (name) => `${createHash('sha256').update(readFileSync(name)).digest('hex')}  ${name}\n`;
writeFileSync('SHA256SUMS', made.map(sum).join(''));
