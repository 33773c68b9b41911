//! A scene with uploads in place of its files of meshes and frames, all else in the lines where it was.

use std::{iter, ops::Range};

use toml::{
    Spanned, Value,
    de::{DeTable, DeValue},
};

use crate::{
    body::{Body, Mesh, Pattern},
    figure::FramesSource,
    scene::Scene,
};

impl Scene {
    /// Its text with uploads in place of files of meshes and frames, each by the id that `id_of` gives for its path, and for that of the
    /// table of springs which a body takes a mesh with: its springs are then those of the mesh. As it was read from a text, every key stays
    /// in its line.
    pub fn text_with_uploads(&self, id_of: impl Fn(&str, Option<&str>) -> Option<String>) -> String {
        let text = self.source.text();
        if !text.is_empty()
            && let Ok(table) = DeTable::parse(text)
        {
            return replaced(text, places(table.get_ref(), &id_of));
        }
        let mut scene = self.clone();
        let mut tables = self.bodies.iter().map(Body::springs_file).chain(iter::repeat(None));
        for mesh in scene.meshes_mut() {
            let springs = tables.next().flatten();
            if let Mesh::File { file, repair } = mesh
                && let Some(upload) = id_of(file, springs)
            {
                *mesh = Mesh::Upload { upload, repair: *repair };
            }
        }
        for body in &mut scene.bodies {
            if let (Some(springs), Mesh::Upload { .. }) = (&mut body.springs, &body.mesh)
                && springs.file.take().is_some()
            {
                springs.pattern = Some(Pattern::File);
            }
        }
        for figure in &mut scene.figures {
            if let FramesSource::File(file) = &figure.frames.source
                && let Some(upload) = id_of(file, None)
            {
                figure.frames.source = FramesSource::Upload(upload);
            }
        }
        scene.to_toml()
    }
}

/// A part of a text, and what takes its place.
type Place = (Range<usize>, String);

/// Where keys and paths of files of meshes, springs and frames stand, and what takes their place.
fn places(root: &DeTable<'_>, id_of: &impl Fn(&str, Option<&str>) -> Option<String>) -> Vec<Place> {
    let objects = root.get("snow").and_then(|snow| snow.get_ref().as_table());
    let objects = objects.map(|snow| tables(snow, "object")).unwrap_or_default();

    let mut places = Vec::new();
    for body in tables(root, "body") {
        let springs = body.get("springs").and_then(named_file);
        let Some(mesh) = body.get("mesh").and_then(named_file) else { continue };
        if let Some(id) = id_of(mesh.path, springs.as_ref().map(|springs| springs.path)) {
            places.extend(mesh.replaced_by("upload", id));
            places.extend(
                springs.into_iter().flat_map(|springs| springs.replaced_by("pattern", "file".to_owned())),
            );
        }
    }
    let figures = tables(root, "figure");
    let owners = objects.into_iter().chain(tables(root, "collider"));
    let meshes = owners.chain(figures.iter().copied()).filter_map(|owner| owner.get("mesh"));
    let frames = figures.iter().filter_map(|figure| figure.get("frames"));
    for file in meshes.chain(frames).filter_map(named_file) {
        if let Some(id) = id_of(file.path, None) {
            places.extend(file.replaced_by("upload", id));
        }
    }
    places.sort_by_key(|(span, _)| span.start);
    places
}

/// A file that a table names, and where its key and its path stand.
struct NamedFile<'t> {
    path: &'t str,
    key: Range<usize>,
    value: Range<usize>,
}

impl NamedFile<'_> {
    /// Another key with another value in their places.
    fn replaced_by(&self, key: &str, value: String) -> [Place; 2] {
        [(self.key.clone(), key.to_owned()), (self.value.clone(), Value::String(value).to_string())]
    }
}

/// The file that a table names by its key `file`.
fn named_file<'t>(from: &'t Spanned<DeValue<'_>>) -> Option<NamedFile<'t>> {
    let (key, value) = from.get_ref().as_table()?.iter().find(|(key, _)| key.get_ref() == "file")?;
    let DeValue::String(path) = value.get_ref() else { return None };
    Some(NamedFile { path, key: key.span(), value: value.span() })
}

/// The tables of an array.
fn tables<'t, 'i>(table: &'t DeTable<'i>, key: &str) -> Vec<&'t DeTable<'i>> {
    match table.get(key).map(Spanned::get_ref) {
        Some(DeValue::Array(items)) => items.iter().filter_map(|item| item.get_ref().as_table()).collect(),
        _ => Vec::new(),
    }
}

/// A text with others in place of parts of it. A part of several lines stays as long.
fn replaced(text: &str, places: Vec<(Range<usize>, String)>) -> String {
    let (mut out, mut end) = (String::with_capacity(text.len()), 0);
    for (span, new) in places {
        let lines = text[span.clone()].matches('\n').count();
        out.push_str(&text[end..span.start]);
        out.push_str(&new);
        out.push_str(&"\n".repeat(lines));
        end = span.end;
    }
    out.push_str(&text[end..]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uploads_stand_where_files_stood_and_all_else_stays_in_its_line() {
        let text = "version = 1 # one\ndt = 1\n\n[[body]]\nname = \"a\" # file = \"a.obj\"\nmesh = { file = \"a.obj\" }\n\
            springs = { file = \"s.csv\" } # file\n\
            [[body]]\nname = \"b\"\n[body.mesh]\nfile = \"\"\"\\\n  b.obj\"\"\"\n[[body]]\nname = \"c\"\nmesh.file = 'a.obj'\n[body.springs]\nfile = 't.csv'\n\
            [snow]\ncell = 0.1\n[[snow.object]]\nname = \"d\"\nmesh = { file = \"other.obj\" }\n\
            [[collider]]\nname = \"e\"\nmesh = { close_holes = true, file = \"c.obj\" } # file = \"c.obj\"\n\
            [[figure]]\nname = \"f\"\nmesh = { file = \"f.ply\" }\nthickness = 0.01\nframes = { file = \"f.pc2\", rate = 30 }\n";
        let scene = Scene::parse(text, "a.toml").expect("a scene");
        let id_of = |file: &str, springs: Option<&str>| {
            (file != "other.obj").then(|| format!("id-{file}{}", springs.unwrap_or_default()))
        };
        let uploaded = scene.text_with_uploads(id_of);
        let expected = text
            .replace("mesh = { file = \"a.obj\"", "mesh = { upload = \"id-a.objs.csv\"")
            .replace("springs = { file = \"s.csv\"", "springs = { pattern = \"file\"")
            .replace("[body.springs]\nfile = 't.csv'", "[body.springs]\npattern = \"file\"")
            .replace("file = \"\"\"\\\n  b.obj\"\"\"\n", "upload = \"id-b.obj\"\n\n")
            .replace("mesh.file = 'a.obj'", "mesh.upload = \"id-a.objt.csv\"")
            .replace("true, file = \"c.obj\"", "true, upload = \"id-c.obj\"")
            .replace("{ file = \"f.ply\"", "{ upload = \"id-f.ply\"")
            .replace("{ file = \"f.pc2\"", "{ upload = \"id-f.pc2\"");
        assert_eq!(uploaded, expected);
        // A scene without a text is written.
        let made = Scene { source: crate::Source::default(), ..scene.clone() };
        let read = Scene::parse(&made.text_with_uploads(id_of), "made").expect("a scene");
        assert_eq!(read, Scene::parse(&uploaded, "uploaded").expect("a scene"));
    }
}
