//! What a recording file holds, read back.
//!
//! Enters: the path of a file. Leaves: rows by entity and timeline, and the layout's entities.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use re_log_encoding::DecoderApp;
use re_sdk::log::{Chunk, LogMsg};

pub(crate) const TIMELINES: [&str; 2] = ["step", "time"];

/// What a file holds: rows by entity and timeline (empty for static rows), and blueprint messages.
#[derive(Default)]
pub(crate) struct Recorded {
    pub(crate) rows: BTreeMap<(String, String), usize>,
    /// Entity, component, and whether the row is static.
    pub(crate) components: BTreeSet<(String, String, bool)>,
    /// Where entities are, row by row (m), and where their own axes point, one after the other.
    pub(crate) translations: BTreeMap<String, Vec<[f32; 3]>>,
    pub(crate) axes: BTreeMap<String, Vec<[f32; 9]>>,
    /// Arrows, row by row: where they point and begin (m), and what is said of them.
    pub(crate) vectors: BTreeMap<String, Vec<Vec<[f32; 3]>>>,
    pub(crate) origins: BTreeMap<String, Vec<Vec<[f32; 3]>>>,
    pub(crate) labels: BTreeMap<String, Vec<Vec<String>>>,
    pub(crate) blueprint_entities: Vec<String>,
    pub(crate) has_active_blueprint: bool,
}

impl Recorded {
    pub(crate) fn read(path: &Path) -> Self {
        let file = BufReader::new(File::open(path).expect("the file was written"));
        let mut recorded = Self::default();
        for message in DecoderApp::decode_lazy(file) {
            match message.expect("the file decodes") {
                LogMsg::ArrowMsg(store, message) => {
                    let chunk = Chunk::from_arrow_msg(&message).expect("a chunk");
                    if store.is_blueprint() {
                        recorded.blueprint_entities.push(chunk.entity_path().to_string());
                    } else {
                        recorded.add(&chunk);
                    }
                }
                LogMsg::BlueprintActivationCommand(_) => recorded.has_active_blueprint = true,
                LogMsg::SetStoreInfo(_) => {}
            }
        }
        recorded
    }

    fn add(&mut self, chunk: &Chunk) {
        let entity = chunk.entity_path().to_string();
        for component in chunk.components_identifiers() {
            let name = component.to_string();
            match name.as_str() {
                "Transform3D:translation" => {
                    let rows = chunk.iter_slices::<[f32; 3]>(component).flatten().copied();
                    self.translations.entry(entity.clone()).or_default().extend(rows);
                }
                "Transform3D:mat3x3" => {
                    let rows = chunk.iter_slices::<[f32; 9]>(component).flatten().copied();
                    self.axes.entry(entity.clone()).or_default().extend(rows);
                }
                "Arrows3D:vectors" => {
                    let rows = chunk.iter_slices::<[f32; 3]>(component).map(<[_]>::to_vec);
                    self.vectors.entry(entity.clone()).or_default().extend(rows);
                }
                "Arrows3D:origins" => {
                    let rows = chunk.iter_slices::<[f32; 3]>(component).map(<[_]>::to_vec);
                    self.origins.entry(entity.clone()).or_default().extend(rows);
                }
                "Arrows3D:labels" => {
                    let rows = chunk.iter_slices::<String>(component);
                    let rows = rows.map(|row| row.iter().map(ToString::to_string).collect::<Vec<_>>());
                    self.labels.entry(entity.clone()).or_default().extend(rows);
                }
                _ => {}
            }
            self.components.insert((entity.clone(), name, chunk.is_static()));
        }
        if chunk.is_static() {
            *self.rows.entry((entity, String::new())).or_default() += chunk.num_rows();
            return;
        }
        for timeline in TIMELINES {
            if chunk.timelines().contains_key(&timeline.into()) {
                let key = (entity.clone(), timeline.to_owned());
                *self.rows.entry(key).or_default() += chunk.num_rows();
            }
        }
    }

    pub(crate) fn count(&self, entity: &str, timeline: &str) -> usize {
        self.rows.get(&(entity.to_owned(), timeline.to_owned())).copied().unwrap_or(0)
    }
}

/// A file that belongs to one test.
pub(crate) fn file(test: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("recording_{test}.rrd"))
}
