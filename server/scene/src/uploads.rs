//! A scene with uploads in place of its files of meshes and frames, all else in the lines where it was.

use std::ops::Range;

use toml::{
    Spanned, Value,
    de::{DeTable, DeValue},
};

use crate::{body::Mesh, figure::FramesSource, scene::Scene};

impl Scene {
    /// Its text with uploads in place of files of meshes and frames, each by the id that `id_of` gives for its path. As it was read from
    /// a text, every key stays in its line.
    pub fn text_with_uploads(&self, id_of: impl Fn(&str) -> Option<String>) -> String {
        let text = self.source.text();
        if !text.is_empty()
            && let Ok(table) = DeTable::parse(text)
        {
            return replaced(text, places(table.get_ref(), &id_of));
        }
        let mut scene = self.clone();
        for mesh in scene.meshes_mut() {
            if let Mesh::File { file, repair } = mesh
                && let Some(upload) = id_of(file)
            {
                *mesh = Mesh::Upload { upload, repair: *repair };
            }
        }
        for figure in &mut scene.figures {
            if let FramesSource::File(file) = &figure.frames.source
                && let Some(upload) = id_of(file)
            {
                figure.frames.source = FramesSource::Upload(upload);
            }
        }
        scene.to_toml()
    }
}

/// Where keys and paths of files of meshes and frames stand, and what takes their place.
fn places(root: &DeTable<'_>, id_of: &impl Fn(&str) -> Option<String>) -> Vec<(Range<usize>, String)> {
    let objects = root.get("snow").and_then(|snow| snow.get_ref().as_table());
    let objects = objects.map(|snow| tables(snow, "object")).unwrap_or_default();

    let mut places = Vec::new();
    let figures = tables(root, "figure");
    let owners = tables(root, "body").into_iter().chain(objects).chain(tables(root, "collider"));
    let meshes = owners.chain(figures.clone()).filter_map(|owner| owner.get("mesh"));
    let frames = figures.iter().filter_map(|figure| figure.get("frames"));
    for from in meshes.chain(frames).filter_map(|from| from.get_ref().as_table()) {
        for (key, value) in from {
            let name: &str = key.get_ref().as_ref();
            if let DeValue::String(file) = value.get_ref()
                && name == "file"
                && let Some(id) = id_of(file)
            {
                places.push((key.span(), "upload".to_owned()));
                places.push((value.span(), Value::String(id).to_string()));
            }
        }
    }
    places.sort_by_key(|(span, _)| span.start);
    places
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
            [[body]]\nname = \"b\"\n[body.mesh]\nfile = \"\"\"\\\n  b.obj\"\"\"\n[[body]]\nname = \"c\"\nmesh.file = 'a.obj'\n\
            [snow]\ncell = 0.1\n[[snow.object]]\nname = \"d\"\nmesh = { file = \"other.obj\" }\n\
            [[collider]]\nname = \"e\"\nmesh = { close_holes = true, file = \"c.obj\" } # file = \"c.obj\"\n\
            [[figure]]\nname = \"f\"\nmesh = { file = \"f.ply\" }\nthickness = 0.01\nframes = { file = \"f.pc2\", rate = 30 }\n";
        let scene = Scene::parse(text, "a.toml").expect("a scene");
        let id_of = |file: &str| (file != "other.obj").then(|| format!("id-{file}"));
        let uploaded = scene.text_with_uploads(id_of);
        let expected = text
            .replace("mesh = { file = \"a.obj\"", "mesh = { upload = \"id-a.obj\"")
            .replace("file = \"\"\"\\\n  b.obj\"\"\"\n", "upload = \"id-b.obj\"\n\n")
            .replace("mesh.file = 'a.obj'", "mesh.upload = \"id-a.obj\"")
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
