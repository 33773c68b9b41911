//! One body to Rerun: a shaded mesh, or its springs as lines, or bare points, as snow is; and its pins.
//!
//! Enters: `Body` once, then positions (m) of all particles and perhaps their colours at each frame. Leaves:
//! the topology once, then only what moved.

use nappe_client::Body;

use crate::{
    error::{RerunError, refused},
    geometry::{Bounds, along, vertex_normals},
    sdk::{Color, Image, LineStrips3D, Mesh3D, Points3D, Radius, RecordingStream},
    spacing::spacing,
};

/// Colours of bodies, in turn.
const PALETTE: [[u8; 3]; 6] =
    [[205, 92, 76], [74, 144, 190], [226, 176, 84], [110, 168, 120], [160, 112, 180], [200, 200, 205]];
/// Checks along a side of a texture, and pixels along a side of a check.
const CHECKS: u32 = 16;
const CHECK_PIXELS: u32 = 8;
/// The darker shade over the lighter.
const DARK_PERCENT: u32 = 82;
const PIN_COLOR: [u8; 3] = [250, 210, 70];
/// Radius of a pin on the screen (points), the same at any distance.
const PIN_RADIUS_POINTS: f32 = 4.0;
const PARTICLE_RADIUS_POINTS: f32 = 2.5;
const SPRING_RADIUS_POINTS: f32 = 1.2;

/// How a body is drawn.
pub(crate) struct BodyView {
    path: String,
    pins_path: String,
    first: usize,
    count: usize,
    color: [u8; 3],
    kind: Kind,
    uv: Option<Vec<[f32; 2]>>,
    /// Pins, counted from the body's first particle.
    pins: Vec<usize>,
}

enum Kind {
    /// Triangles, counted from the body's first particle.
    Mesh(Vec<[u32; 3]>),
    /// Springs, counted from the body's first particle.
    Springs(Vec<[u32; 2]>),
    Points,
}

impl BodyView {
    /// Body number `index` of a session.
    pub(crate) fn new(body: &Body, index: usize) -> Self {
        let base = body.first_particle as u32;
        let kind = if !body.triangles.is_empty() {
            Kind::Mesh(body.triangles.iter().map(|t| t.map(|particle| particle - base)).collect())
        } else if !body.springs.is_empty() {
            Kind::Springs(body.springs.iter().map(|s| s.map(|particle| particle - base)).collect())
        } else {
            Kind::Points
        };
        let path = format!("world/bodies/{}", entity_name(&body.name, index));
        Self {
            pins_path: format!("world/pins/{}", entity_name(&body.name, index)),
            path,
            first: body.first_particle,
            count: body.particle_count,
            color: body.color.unwrap_or(PALETTE[index % PALETTE.len()]),
            kind,
            uv: (!body.uv.is_empty()).then(|| body.uv.clone()),
            pins: body.pins.iter().map(|&pin| (pin - base) as usize).collect(),
        }
    }

    /// True if it is made of bare points, as snow is.
    pub(crate) fn is_points(&self) -> bool {
        matches!(self.kind, Kind::Points)
    }

    /// Grows the bounds of the scene by where the body is, and by where it can hang from its highest pin.
    pub(crate) fn add_to(&self, bounds: &mut Bounds, all: &[[f32; 3]]) {
        let points = &all[self.first..self.first + self.count];
        let mut own = Bounds::empty();
        for &point in points {
            own.add(point);
            bounds.add(point);
        }
        let highest = self.pins.iter().map(|&pin| points[pin]).max_by(|a, b| a[1].total_cmp(&b[1]));
        if let Some(pin) = highest {
            bounds.add(along(pin, -2.0 * own.radius(), [0.0, 1.0, 0.0]));
        }
    }

    /// Logs what never changes.
    pub(crate) fn describe(&self, stream: &RecordingStream) -> Result<(), RerunError> {
        let logged = match &self.kind {
            Kind::Mesh(triangles) => {
                let mesh = Mesh3D::update_fields().with_triangle_indices(triangles.iter().copied());
                let mesh = match &self.uv {
                    Some(uv) => mesh
                        .with_vertex_texcoords(uv.iter().copied())
                        .with_albedo_texture_image(checks(self.color)),
                    None => mesh.with_albedo_factor(*rgb(self.color)),
                };
                stream.log_static(&*self.path, &mesh)
            }
            Kind::Springs(_) => {
                let radius = Radius::new_ui_points(SPRING_RADIUS_POINTS);
                let lines = LineStrips3D::update_fields().with_radii([radius]).with_colors([rgb(self.color)]);
                stream.log_static(&*self.path, &lines)
            }
            // Their radius waits for the first frame.
            Kind::Points => Ok(()),
        };
        logged.map_err(refused(&self.path))?;
        if self.pins.is_empty() {
            return Ok(());
        }
        let pins = Points3D::update_fields()
            .with_radii([Radius::new_ui_points(PIN_RADIUS_POINTS)])
            .with_colors([rgb(PIN_COLOR)]);
        stream.log_static(&*self.pins_path, &pins).map_err(refused(&self.pins_path))
    }

    /// Logs what the first frame tells of bare points: a radius of half their spacing, and the body's colour
    /// unless `colors` says another for each. (What is logged once hides what is logged with a frame.)
    pub(crate) fn log_static(
        &self,
        stream: &RecordingStream,
        all: &[[f32; 3]],
        colors: Option<&[Color]>,
    ) -> Result<(), RerunError> {
        if !self.is_points() {
            return Ok(());
        }
        let radius = match spacing(&all[self.first..self.first + self.count]) {
            Some(spacing) => Radius::new_scene_units(0.5 * spacing),
            None => Radius::new_ui_points(PARTICLE_RADIUS_POINTS),
        };
        let mut points = Points3D::update_fields().with_radii([radius]);
        if colors.is_none() {
            points = points.with_colors([rgb(self.color)]);
        }
        stream.log_static(&*self.path, &points).map_err(refused(&self.path))
    }

    /// Logs the body at the stream's current time, from the positions of all particles and, for bare points,
    /// their colours.
    pub(crate) fn log(
        &self,
        stream: &RecordingStream,
        all: &[[f32; 3]],
        colors: Option<&[Color]>,
    ) -> Result<(), RerunError> {
        let points = &all[self.first..self.first + self.count];
        let logged = match &self.kind {
            Kind::Mesh(triangles) => {
                let mesh = Mesh3D::update_fields()
                    .with_vertex_positions(points.iter().copied())
                    .with_vertex_normals(vertex_normals(points, triangles));
                stream.log(&*self.path, &mesh)
            }
            Kind::Springs(springs) => {
                let strips = springs.iter().map(|spring| spring.map(|particle| points[particle as usize]));
                stream.log(&*self.path, &LineStrips3D::update_fields().with_strips(strips))
            }
            Kind::Points => {
                let mut cloud = Points3D::update_fields().with_positions(points.iter().copied());
                if let Some(colors) = colors {
                    cloud = cloud.with_colors(colors[self.first..self.first + self.count].iter().copied());
                }
                stream.log(&*self.path, &cloud)
            }
        };
        logged.map_err(refused(&self.path))?;
        if self.pins.is_empty() {
            return Ok(());
        }
        let pins = Points3D::update_fields().with_positions(self.pins.iter().map(|&pin| points[pin]));
        stream.log(&*self.pins_path, &pins).map_err(refused(&self.pins_path))
    }
}

/// A weave of checks in two shades of a colour, so that the eye sees how a cloth stretches and turns.
fn checks(color: [u8; 3]) -> Image {
    let shade = |value: u8| (u32::from(value) * DARK_PERCENT / 100) as u8;
    let side = CHECKS * CHECK_PIXELS;
    let pixels = (0..side * side).flat_map(|pixel| {
        let (row, column) = (pixel / side / CHECK_PIXELS, pixel % side / CHECK_PIXELS);
        if (row + column).is_multiple_of(2) { color } else { color.map(shade) }
    });
    Image::from_rgb24(pixels.collect::<Vec<u8>>(), [side, side])
}

fn rgb([red, green, blue]: [u8; 3]) -> Color {
    Color::from_rgb(red, green, blue)
}

/// A name that makes one part of an entity path, and is not another body's.
pub(crate) fn entity_name(name: &str, index: usize) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '_' { c } else { '_' }).collect();
    if plain.is_empty() { format!("body_{index}") } else { format!("{index}_{plain}") }
}
