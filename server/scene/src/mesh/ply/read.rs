//! Reading of a PLY: points, texture coordinates, masses, triangles of faces, strips and fans, and springs.

use nappe_sim::mesh::TriangleMesh;

use super::{
    header::{Element, Encoding, Header},
    payload::{Payload, Row, named},
    places::{MASS, Place, U, V, VELOCITY},
    springs::{are_springs, read_springs},
};
use crate::{
    error::{ErrorKind, SceneError},
    mesh::{
        loaded::Loaded,
        memory::{self, BESIDE, GROWTH, corner_bytes, make_room},
        polygon::{Placed, Polygons},
    },
};

/// What stands between strips, and between fans, of one list.
const END: i64 = -1;

/// Reads a PLY.
///
/// # Errors
/// The first error; with its line where it is in the header or in a payload of text.
pub fn read_ply(bytes: &[u8], file: &str) -> Result<Loaded, SceneError> {
    let header = Header::read(bytes, file)?;
    header.check_counts(file)?;
    let mut payload = Payload::new(&header, file);
    let mut mesh = TriangleMesh::default();
    let (mut row, mut has_points, mut before) = (Row::default(), false, Vec::new());
    let mut polygons = Polygons::new();

    // Elements without properties take no place, however many there are.
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        if element.name == b"vertex" {
            read_points(&mut payload, element, &mut mesh)?;
            has_points = true;
        } else if names_points(element) && has_points {
            read_part(&mut payload, element, &mut polygons, &mut mesh)?;
        } else {
            if names_points(element) {
                before.push((element, payload.clone()));
            }
            for index in 0..element.count {
                payload.read(element, index, &mut row)?;
            }
        }
    }
    // Faces and springs that stand before their points.
    for (element, mut payload) in before {
        read_part(&mut payload, element, &mut polygons, &mut mesh)?;
    }

    let placed = if header.encoding == Encoding::Text { Placed::Lines } else { Placed::Faces };
    let mut warnings = header.warnings;
    warnings.extend(polygons.warnings(file, placed));
    match payload.left_bytes() {
        0 => {}
        left => warnings.push(format!("{file}: {left} bytes after the last element are ignored")),
    }
    Ok(Loaded { mesh, warnings })
}

/// Whether elements name points: faces, strips, fans, springs.
fn names_points(element: &Element<'_>) -> bool {
    element.has(Place::Corners) || are_springs(element)
}

fn read_part(
    payload: &mut Payload<'_>,
    element: &Element<'_>,
    polygons: &mut Polygons,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    if are_springs(element) {
        read_springs(payload, element, mesh)
    } else {
        read_triangles(payload, element, polygons, mesh)
    }
}

fn read_points(
    payload: &mut Payload<'_>,
    element: &Element<'_>,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    let (has_uv, has_mass) = (has_uv(element), element.has(MASS));
    let has_velocity = has_velocity(element);
    let room = |is_read: bool| if is_read { element.count as usize } else { 0 };
    make_room(&mut mesh.points, room(true));
    make_room(&mut mesh.uv, room(has_uv));
    make_room(&mut mesh.masses, room(has_mass));
    make_room(&mut mesh.velocities, room(has_velocity));
    let mut row = Row::default();
    for index in 0..element.count {
        payload.read(element, index, &mut row)?;
        let [x, y, z, u, v, mass, vx, vy, vz] = row.numbers;
        mesh.points.push([x, y, z]);
        if has_uv {
            mesh.uv.push([u, v]);
        }
        if has_mass {
            mesh.masses.push(mass);
        }
        if has_velocity {
            mesh.velocities.push([vx, vy, vz]);
        }
    }
    Ok(())
}

fn has_uv(element: &Element<'_>) -> bool {
    element.has(U) && element.has(V)
}

fn has_velocity(element: &Element<'_>) -> bool {
    VELOCITY.into_iter().all(|place| element.has(place))
}

/// Faces are polygons; a strip or a fan ends at -1 or with its list.
fn read_triangles(
    payload: &mut Payload<'_>,
    element: &Element<'_>,
    polygons: &mut Polygons,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    let is_face = element.name == b"face";
    make_room(&mut mesh.triangles, payload.clone().pass(element).triangles);
    let (mut row, mut corners) = (Row::default(), Vec::new());
    for index in 0..element.count {
        payload.read(element, index, &mut row)?;
        for piece in row.corners.split(|corner| *corner == END && !is_face) {
            corners.clear();
            for corner in piece {
                corners.push(point(payload, (element, index), *corner, mesh.points.len())?);
            }
            match element.name {
                b"face" => {
                    let place = payload.line().unwrap_or(index as usize);
                    polygons.cut(&mesh.points, &corners, place, &mut mesh.triangles);
                }
                b"tristrips" => mesh.triangles.extend(strip(&corners)),
                _ => mesh.triangles.extend(around_first(&corners)),
            }
        }
    }
    Ok(())
}

/// The index of a point, below `count`.
fn point(
    payload: &Payload<'_>,
    (element, index): (&Element<'_>, u64),
    corner: i64,
    count: usize,
) -> Result<u32, SceneError> {
    let point = u32::try_from(corner).ok().filter(|point| (*point as usize) < count);
    point.ok_or_else(|| {
        let allowed = match (count, element.name) {
            (0, _) => "none, there are no points".to_owned(),
            (_, b"face") => format!("0 to {}, the points of this mesh", count - 1),
            _ => format!("0 to {}, the points of this mesh, and -1 at an end", count - 1),
        };
        let message = format!("{} names point {corner}; allowed: {allowed}", named(element, index));
        payload.error(ErrorKind::OutOfRange, message)
    })
}

/// Triangles of a strip: every second one runs the other way round. Those that name a point twice join its parts.
fn strip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let triangles = corners.windows(3).enumerate().map(|(i, corners)| match i % 2 {
        0 => [corners[0], corners[1], corners[2]],
        _ => [corners[1], corners[0], corners[2]],
    });
    triangles.filter(has_three_points)
}

/// Triangles of a fan about its first point.
fn around_first(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let pairs = corners.windows(2).skip(1);
    pairs.map(move |pair| [corners[0], pair[0], pair[1]]).filter(has_three_points)
}

fn has_three_points(&[a, b, c]: &[u32; 3]) -> bool {
    a != b && b != c && a != c
}

/// Bytes that reading takes at most, beside the file's own.
pub(in crate::mesh) fn memory_bytes(bytes: &[u8]) -> u64 {
    let Ok(header) = Header::read(bytes, "") else { return Header::most_bytes(bytes.len(), GROWTH) };
    let beside = header.memory_bytes(GROWTH) + BESIDE;
    if header.check_counts("").is_err() {
        return beside;
    }

    let mut payload = Payload::new(&header, "");
    let (mut arrays, mut triangles, mut longest, mut kinds) = (0, 0, 0, 0);
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        if element.name == b"vertex" {
            let parts = [
                (true, memory::POINT),
                (has_uv(element), memory::UV),
                (element.has(MASS), memory::MASS),
                (has_velocity(element), memory::POINT),
            ];
            let of_point: u64 = parts.iter().filter(|(is_read, _)| *is_read).map(|(_, bytes)| bytes).sum();
            arrays += of_point * element.count;
        }
        if are_springs(element) {
            arrays += memory::SPRING * element.count;
        }
        let lists = payload.pass(element);
        triangles += lists.triangles as u64;
        longest = longest.max(lists.longest);
        kinds += u64::from(element.has(Place::Corners));
    }
    // Triangles of a second kind of faces are put behind those of the first, which are copied.
    let copies = if kinds > 1 { 2 } else { 1 };
    let row = GROWTH * size_of::<i64>() as u64 * longest as u64;
    beside + arrays + copies * memory::TRIANGLE * triangles + row + corner_bytes(longest)
}
