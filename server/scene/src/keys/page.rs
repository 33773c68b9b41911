//! The reference page of the scene format, written from the schema.

use std::fmt::Write;

use nappe_sim::{math::number, snow::Preset};

use super::scene::ROOT;
use crate::{
    fabric::Fabric,
    schema::{Alternatives, Presence, Section, ValueKind},
};

/// The reference part of docs/scenes.md: every section, every key with unit, default and range.
pub fn page() -> String {
    let mut sections = Vec::new();
    collect(&ROOT, &mut sections);
    let mut text = String::new();
    for section in sections {
        write_section(&mut text, section);
    }
    write_fabrics(&mut text);
    write_presets(&mut text);
    text
}

/// The table of fabrics.
fn write_fabrics(text: &mut String) {
    text.push_str("\n### Fabrics\n\n");
    text.push_str("| fabric | density (kg/m^2) | stretch: warp, weft (N/m) | shear (N/m) | bending (N m) | damping (s) | how thick (m) |\n");
    text.push_str("|---|---|---|---|---|---|---|\n");
    for Fabric { name, density, stretch: [warp, weft], shear, bending, damping, thickness } in Fabric::ALL {
        let [bending, thickness] = [bending, thickness].map(number);
        let _ = writeln!(
            text,
            "| `{name}` | {density} | {warp}, {weft} | {shear} | {bending} | {damping} | {thickness} |"
        );
    }
}

/// The table of snow's presets.
fn write_presets(text: &mut String) {
    text.push_str("\n### Presets of snow\n\n");
    text.push_str("| preset | law | Young's modulus (Pa) | Poisson's ratio | density (kg/m^3) | yield: theta_c, theta_s, xi, J_P | source |\n");
    text.push_str("|---|---|---|---|---|---|---|\n");
    for preset in Preset::ALL {
        let Preset { name, source, density, material } = preset;
        let (law, young, poisson) = (material.law.name(), number(material.young), material.poisson);
        let yields = material.plasticity.map_or("none".to_owned(), |p| {
            let [low, high] = p.plastic_ratio_range;
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
    for key in section.keys {
        if let ValueKind::Table(inner) | ValueKind::Tables(inner, _) = key.kind {
            collect(inner, sections);
        }
    }
}

fn write_section(text: &mut String, section: &Section) {
    // Writing to a String cannot fail.
    let _ = write!(text, "\n### {}\n\n{}\n\n", section.name, section.about);
    text.push_str("| key | unit | default | allowed | meaning |\n|---|---|---|---|---|\n");
    for key in section.keys {
        let default = match key.presence {
            Presence::Required => "**required**".to_owned(),
            Presence::Default(value) => format!("`{value}`"),
            Presence::Absent(meaning) => meaning.to_owned(),
            Presence::Chosen => "see below".to_owned(),
        };
        let cells = [key.name, key.unit, &default, &key.kind.allowed(), key.about].map(cell);
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }

    match section.alternatives {
        Alternatives::None => {}
        Alternatives::OneChosen => {
            let names: Vec<String> = section.choices().iter().map(|name| format!("`{name}`")).collect();
            let _ = writeln!(text, "\nExactly one of {} is needed.", names.join(", "));
        }
        Alternatives::OneOf(list) => {
            text.push_str("\nExactly one of these is needed:\n\n");
            for alternative in list {
                let _ = write!(text, "- `{}`", alternative.key);
                if !alternative.needs.is_empty() {
                    let _ = write!(text, ", with {}", alternative.needs.join(", "));
                }
                if !alternative.may.is_empty() {
                    let _ = write!(text, ", optionally {}", alternative.may.join(", "));
                }
                text.push('\n');
            }
        }
    }
}

/// A text in a cell of a table, where a bar would end the cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use toml::{
        Spanned,
        de::{DeTable, DeValue},
    };

    use super::*;
    use crate::{error::Found, schema, source::Source};

    #[test]
    fn every_example_of_a_table_is_allowed() {
        let mut sections = Vec::new();
        collect(&ROOT, &mut sections);
        for section in sections {
            let text = format!("example = {}", section.example());
            let table = DeTable::parse(&text).expect("it is TOML");
            let Some(DeValue::Table(example)) = table.get_ref().get("example").map(Spanned::get_ref) else {
                panic!("{text}")
            };
            let mut found = Found::default();
            let _ = schema::check(section, example, &Source::new("example", ""), &mut found);
            assert!(found.or(()).is_ok(), "{}: {text}", section.name);
        }
    }
}
