// Which files are a scene and its meshes, and which are refused.

import assert from 'node:assert/strict';
import { test } from 'node:test';
import { load } from './bundle.mjs';

const { Meshes, Refused, checkSize, meshPaths, sceneAmong, withUploads } = await load('src/live/files.ts');

const given = (...paths) => paths.map((path) => ({ path, file: new File(['x'], path.split('/').pop()) }));
const refused = (doing, file, why) => assert.throws(doing, (error) => error instanceof Refused && error.file === file && why.test(error.why));

const TEXT = `title = "file = 'no.obj'" # file = "none.obj"
note = """
mesh = { file = "neither.obj" }
"""
mesh = { file = "a b.obj", weld = 1e-6 }
mesh = {file='c.ply'}
mesh.file = "a b.obj"
my-file = "no.obj"
profile = "no.obj"
`;

test('meshes stand where a scene names them, and lines stay where they are', () => {
  assert.deepEqual(meshPaths(TEXT), ['a b.obj', 'c.ply']);
  const sent = withUploads(TEXT, new Map([['a b.obj', 'mesh-1'], ['c.ply', 'mesh-2']]));
  assert.equal(sent, TEXT.replace('file = "a b.obj",', 'upload = "mesh-1",').replace("file='c.ply'", 'upload = "mesh-2"').replace('mesh.file = "a b.obj"', 'mesh.upload = "mesh-1"'));
  assert.equal(withUploads(TEXT, new Map()), TEXT);
  assert.deepEqual(meshPaths(''), []);
});

test('one of the files is the scene', () => {
  assert.equal(sceneAmong(given('a.obj', 'My Scene.TOML')).path, 'My Scene.TOML');
  refused(() => sceneAmong(given('a.obj')), 'a.obj', /no scene/);
  refused(() => sceneAmong(given('1', '2', '3', '4', '5', '6', '7')), '1, 2, 3, 4, 5 and 2 more', /none/);
  refused(() => sceneAmong(given('a.toml', 'b/c.toml', 'd.obj')), 'a.toml, b/c.toml', /several/);
});

test('meshes are found within the folder of the scene', () => {
  const files = given('work/mine.toml', 'work/a.obj', 'work/in/b.PLY', 'work/set/points.eti', 'work/set/masses.eti', 'work/c.stl.gz', 'a.obj');
  const [scene, a, b, points, masses, c] = files;
  const meshes = new Meshes(scene, files);
  assert.deepEqual(meshes.of('a.obj'), { format: 'obj', data: a.file, others: {}, isPacked: false });
  assert.equal(meshes.of('./in/../a.obj').data, a.file);
  assert.deepEqual([meshes.of('in/b.PLY').format, meshes.of('in/b.PLY').data], ['ply', b.file]);
  for (const name of ['set', 'set/', 'set/points.eti']) {
    const { format, data, others } = meshes.of(name);
    assert.deepEqual([format, data, others], ['eti', points.file, { masses: masses.file }], name);
  }
  assert.deepEqual([meshes.of('c.stl.gz').format, meshes.of('c.stl.gz').data, meshes.of('c.stl.gz').isPacked], ['stl', c.file, true]);
  for (const path of ['../a.obj', 'in/../../a.obj', '/a.obj', 'C:\\a.obj', '\\a.obj']) {
    refused(() => meshes.of(path), 'work/mine.toml', /outside its folder/);
  }
  refused(() => meshes.of('b.ply'), 'work/mine.toml', /b\.ply is not among/);
  refused(() => meshes.of('other'), 'work/mine.toml', /other\/points\.eti is not among/);
  for (const path of ['a.gltf', 'a.eti.gz', 'a.gz']) refused(() => meshes.of(path), path, /ending/);
});

test('files without folders are known by their names, each for one mesh', () => {
  const files = given('mine.toml', 'a.obj');
  const meshes = new Meshes(files[0], files);
  assert.equal(meshes.of('one/a.obj').data, files[1].file);
  assert.equal(meshes.of('one/a.obj').data, files[1].file);
  refused(() => meshes.of('two/a.obj'), 'mine.toml', /two\/a\.obj is not among/);
});

test('a size is refused above the limit, with both numbers', () => {
  checkSize('a.obj', 1000, 1000, 'a mesh');
  refused(() => checkSize('a.obj', 1001, 1000, 'a mesh'), 'a.obj', /1,001 bytes.*a mesh.*1,000/);
});
