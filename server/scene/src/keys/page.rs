//! The reference page of the scene format, written from the schema.

use std::fmt::Write;

use nappe_sim::snow::Preset;

use super::scene::ROOT;
use crate::schema::{Kind, Presence, Section, number};

/// The reference part of docs/scenes.md: every section, every field with unit, default and range.
pub fn page() -> String {
    let mut sections = Vec::new();
    collect(&ROOT, &mut sections);
    let mut text = String::new();
    for section in sections {
        write_section(&mut text, section);
    }
    write_presets(&mut text);
    text
}

/// The table of snow's materials.
fn write_presets(text: &mut String) {
    text.push_str("\n### Presets of snow\n\n");
    text.push_str("| preset | law | Young's modulus (Pa) | Poisson's ratio | density (kg/m^3) | yield: theta_c, theta_s, xi, Jp | source |\n");
    text.push_str("|---|---|---|---|---|---|---|\n");
    for preset in Preset::ALL {
        let Preset { name, source, density, material } = preset;
        let (law, young, poisson) = (material.law.name(), number(material.young), material.poisson);
        let yields = material.plasticity.map_or("none".to_owned(), |p| {
            let [low, high] = p.jp_range;
            format!("{}, {}, {}, {low} to {high}", p.critical_compression, p.critical_stretch, p.hardening)
        });
        let _ =
            writeln!(text, "| `{name}` | {law} | {young} | {poisson} | {density} | {yields} | {source} |");
    }
}

/// Sections in the order in which they are first named.
fn collect(section: &'static Section, sections: &mut Vec<&'static Section>) {
    if sections.iter().any(|s| s.name == section.name) {
        return;
    }
    sections.push(section);
    for field in section.fields {
        if let Kind::Table(inner) | Kind::Tables(inner, _) = field.kind {
            collect(inner, sections);
        }
    }
}

fn write_section(text: &mut String, section: &Section) {
    // Writing to a String cannot fail.
    let _ = write!(text, "\n### {}\n\n{}\n\n", section.name, section.about);
    text.push_str("| field | unit | default | allowed | meaning |\n|---|---|---|---|---|\n");
    for field in section.fields {
        let default = match field.presence {
            Presence::Required => "**required**".to_owned(),
            Presence::Default(value) => format!("`{value}`"),
            Presence::Absent(meaning) => meaning.to_owned(),
            Presence::Chosen => "see below".to_owned(),
        };
        let allowed = field.kind.allowed();
        let _ =
            writeln!(text, "| {} | {} | {default} | {allowed} | {} |", field.name, field.unit, field.about);
    }
    if section.alternatives.is_empty() {
        return;
    }
    text.push_str("\nExactly one of:\n\n");
    for alternative in section.alternatives {
        let _ = write!(text, "- `{}`", alternative.key);
        let needs: Vec<&str> = alternative.needs.to_vec();
        if !needs.is_empty() {
            let _ = write!(text, ", with {}", needs.join(", "));
        }
        if !alternative.may.is_empty() {
            let _ = write!(text, ", optionally {}", alternative.may.join(", "));
        }
        text.push('\n');
    }
}
