//! Writing of VTK XML files (.vtp): points, cells over them, numbers of both, and what is told of the whole.
//!
//! Enters: arrays. Leaves: bytes. Arrays are appended little-endian, packed by zlib in blocks; a file holds the same bits. The
//! same arrays give the same bytes.

use std::{fmt::Write as _, io};

use flate2::{Compress, Compression, FlushCompress, Status};

/// Bytes that are packed together.
const BLOCK: usize = 1 << 16;
/// Levels of zlib, for arrays of one file and of all. At level 1, some makes of zlib have fixed codes alone, which make numbers longer.
const OF_ONE: u32 = 2;
const OF_ALL: u32 = 6;

/// Numbers of an array, in the type that a file has for them.
#[derive(Clone, Copy, Debug)]
pub enum VtpNumbers<'a> {
    /// Numbers in binary32.
    F32(&'a [f32]),
    /// Numbers in binary64.
    F64(&'a [f64]),
    /// Whole numbers of 32 bits.
    I32(&'a [i32]),
}

impl VtpNumbers<'_> {
    /// What a file calls their type, the bytes of one, the bytes of all.
    fn parts(self) -> (&'static str, usize, Vec<u8>) {
        match self {
            Self::F32(numbers) => ("Float32", 4, little_endian(numbers, f32::to_le_bytes)),
            Self::F64(numbers) => ("Float64", 8, little_endian(numbers, f64::to_le_bytes)),
            Self::I32(numbers) => ("Int32", 4, little_endian(numbers, i32::to_le_bytes)),
        }
    }
}

/// An array as a file has it, so that one which stays the same is packed once.
#[derive(Clone, Debug)]
pub struct VtpArray {
    /// Its element, up to the place of its bytes.
    head: String,
    /// Points or cells that it has numbers of.
    count: usize,
    /// How its blocks are divided, and the blocks.
    packed: Vec<u8>,
}

impl VtpArray {
    /// Packs an array of this name, with so many numbers a point or cell.
    ///
    /// # Panics
    /// If there is a part of a point or cell.
    pub fn new(name: &str, components: usize, numbers: VtpNumbers<'_>) -> Self {
        Self::at_level(OF_ONE, name, components, numbers)
    }

    fn at_level(level: u32, name: &str, components: usize, numbers: VtpNumbers<'_>) -> Self {
        let (kind, width, bytes) = numbers.parts();
        let (entry, shown) = (components * width, escaped(name));
        assert!(bytes.len().is_multiple_of(entry), "{components} numbers each: {name}");
        Self {
            head: format!(
                "<DataArray type=\"{kind}\" Name=\"{shown}\" NumberOfComponents=\"{components}\" format=\"appended\""
            ),
            count: bytes.len() / entry,
            packed: packed(&bytes, level),
        }
    }
}

/// Cells of one kind: vertices, lines or triangles.
#[derive(Clone, Debug)]
pub struct VtpCells {
    count: usize,
    /// The points of all cells, and where those of each cell end.
    arrays: [VtpArray; 2],
}

impl VtpCells {
    /// Packs cells of `N` points each, which all files may have: indices of points, fewer than 2^31 in all.
    pub fn new<const N: usize>(cells: &[[u32; N]]) -> Self {
        let corners: Vec<i32> = cells.as_flattened().iter().map(|&point| point as i32).collect();
        let ends: Vec<i32> = (1..=cells.len()).map(|cell| (cell * N) as i32).collect();
        let arrays = [("connectivity", corners), ("offsets", ends)];
        Self {
            count: cells.len(),
            arrays: arrays
                .map(|(name, numbers)| VtpArray::at_level(OF_ALL, name, 1, VtpNumbers::I32(&numbers))),
        }
    }

    /// Its arrays; none where there are no cells.
    fn written(&self) -> &[VtpArray] {
        if self.count == 0 { &[] } else { &self.arrays }
    }
}

/// What is told of a whole file, beside its points and cells.
#[derive(Clone, Debug, PartialEq)]
pub struct VtpFact {
    /// Its name in the file.
    pub name: String,
    /// What is told.
    pub told: VtpTold,
}

/// What a fact tells.
#[derive(Clone, Debug, PartialEq)]
pub enum VtpTold {
    /// Vectors of so many numbers, one after the other; nothing is told where one is not finite, which no reader takes.
    Numbers(usize, Vec<f64>),
    /// Whole numbers, 0 and above.
    Counts(Vec<u64>),
    /// Texts; none of them has a character 0.
    Texts(Vec<String>),
}

/// What a file holds.
#[derive(Clone, Copy, Debug)]
pub struct VtpFile<'a> {
    /// What is told of all.
    pub facts: &'a [VtpFact],
    /// Positions of the points (m), three numbers each.
    pub points: &'a VtpArray,
    /// Numbers of the points.
    pub point_data: &'a [VtpArray],
    /// Numbers of the cells: of vertices, then lines, then triangles.
    pub cell_data: &'a [VtpArray],
    /// Cells of one point.
    pub vertices: &'a VtpCells,
    /// Cells of two points.
    pub lines: &'a VtpCells,
    /// Cells of three points.
    pub triangles: &'a VtpCells,
}

/// Writes a file.
///
/// # Errors
/// Those of `out`.
///
/// # Panics
/// If an array has not one entry for each point or cell.
pub fn write_vtp(file: &VtpFile<'_>, out: &mut impl io::Write) -> io::Result<()> {
    let points = file.points.count;
    let cells = file.vertices.count + file.lines.count + file.triangles.count;
    assert!(file.point_data.iter().all(|array| array.count == points), "an entry for each point");
    assert!(file.cell_data.iter().all(|array| array.count == cells), "an entry for each cell");

    let mut elements = Elements::new(file.facts);
    // Writing into a string does not fail.
    let _ = writeln!(
        elements.text,
        "<Piece NumberOfPoints=\"{points}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">",
        file.vertices.count, file.lines.count, file.triangles.count
    );
    elements.section("PointData", file.point_data);
    elements.section("CellData", file.cell_data);
    elements.section("Points", std::slice::from_ref(file.points));
    elements.section("Verts", file.vertices.written());
    elements.section("Lines", file.lines.written());
    elements.section("Strips", &[]);
    elements.section("Polys", file.triangles.written());
    elements.text.push_str("</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");

    out.write_all(elements.text.as_bytes())?;
    for array in elements.appended {
        out.write_all(&array.packed)?;
    }
    out.write_all(b"\n</AppendedData>\n</VTKFile>\n")
}

/// The elements of a file, and the arrays that follow them.
struct Elements<'a> {
    text: String,
    appended: Vec<&'a VtpArray>,
    /// Where the next array begins.
    offset: usize,
}

impl<'a> Elements<'a> {
    /// The first elements: what is told of all.
    fn new(facts: &[VtpFact]) -> Self {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt32\" compressor=\"vtkZLibDataCompressor\">\n<PolyData>\n<FieldData>\n",
        );
        for fact in facts {
            if let Some((kind, shape, numbers)) = fact.told.parts() {
                let element = if kind == "String" { "Array" } else { "DataArray" };
                // Writing into a string does not fail.
                let _ = writeln!(
                    text,
                    "<{element} type=\"{kind}\" Name=\"{}\" {shape} format=\"ascii\">{numbers}</{element}>",
                    escaped(&fact.name)
                );
            }
        }
        text.push_str("</FieldData>\n");
        Self { text, appended: Vec::new(), offset: 0 }
    }

    /// An element with arrays.
    fn section(&mut self, name: &str, arrays: &'a [VtpArray]) {
        // Writing into a string does not fail.
        let _ = writeln!(self.text, "<{name}>");
        for array in arrays {
            let _ = writeln!(self.text, "{} offset=\"{}\"/>", array.head, self.offset);
            self.offset += array.packed.len();
            self.appended.push(array);
        }
        let _ = writeln!(self.text, "</{name}>");
    }
}

impl VtpTold {
    /// Type, shape and text of an element; none where nothing is told.
    fn parts(&self) -> Option<(&'static str, String, String)> {
        Some(match self {
            Self::Numbers(components, numbers) => {
                if !numbers.iter().all(|number| number.is_finite()) {
                    return None;
                }
                let (count, text) = (numbers.len() / components, joined(numbers));
                ("Float64", format!("NumberOfComponents=\"{components}\" NumberOfTuples=\"{count}\""), text)
            }
            Self::Counts(counts) => {
                ("UInt64", format!("NumberOfTuples=\"{}\"", counts.len()), joined(counts))
            }
            Self::Texts(texts) => {
                // Each byte as a number, and a 0 after each text.
                let bytes: Vec<u8> =
                    texts.iter().flat_map(|text| text.bytes().chain(std::iter::once(0))).collect();
                ("String", format!("NumberOfTuples=\"{}\"", texts.len()), joined(&bytes))
            }
        })
    }
}

/// A text as a value of an attribute.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Numbers with all their digits.
fn joined(numbers: &[impl ToString]) -> String {
    numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

fn little_endian<T: Copy, const N: usize>(numbers: &[T], bytes_of: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    let mut bytes = vec![0; N * numbers.len()];
    let (places, _) = bytes.as_chunks_mut::<N>();
    for (place, number) in places.iter_mut().zip(numbers) {
        *place = bytes_of(*number);
    }
    bytes
}

/// Bytes in blocks: how many there are, how long, how long the last one if it is shorter, how long each is packed, the blocks.
fn packed(bytes: &[u8], level: u32) -> Vec<u8> {
    let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(|block| deflate(block, level)).collect();
    let sizes = [blocks.len(), BLOCK, bytes.len() % BLOCK].into_iter().chain(blocks.iter().map(Vec::len));
    let mut all: Vec<u8> = sizes.flat_map(|size| (size as u32).to_le_bytes()).collect();
    for block in &blocks {
        all.extend_from_slice(block);
    }
    all
}

fn deflate(bytes: &[u8], level: u32) -> Vec<u8> {
    let mut compress = Compress::new(Compression::new(level), true);
    let mut packed = Vec::with_capacity(bytes.len() + 64);
    loop {
        let taken = compress.total_in() as usize;
        let status = compress.compress_vec(&bytes[taken..], &mut packed, FlushCompress::Finish);
        match status {
            Ok(Status::StreamEnd) => return packed,
            // There was no room for the rest.
            _ => packed.reserve(packed.len().max(64)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use flate2::read::ZlibDecoder;

    use super::*;

    /// The bytes of an array of a file, by the words that open its element.
    fn read(file: &[u8], opening: &str) -> Vec<u8> {
        let mark = b"<AppendedData encoding=\"raw\">\n_";
        let at = file.windows(mark.len()).position(|window| window == mark).expect("appended data");
        let (text, data) = (String::from_utf8_lossy(&file[..at]), &file[at + mark.len()..]);
        let element = text.lines().find(|line| line.starts_with(opening)).expect("an element");
        let (_, offset) = element.split_once("offset=\"").expect("an offset");
        let offset: usize = offset.split('"').next().expect("a number").parse().expect("a number");
        let word = |index: usize| {
            let place = offset + 4 * index;
            u32::from_le_bytes(data[place..place + 4].try_into().expect("four bytes")) as usize
        };
        let (count, mut place, mut bytes) = (word(0), offset + 4 * (3 + word(0)), Vec::new());
        for block in 0..count {
            let before = bytes.len();
            let part = &data[place..place + word(3 + block)];
            ZlibDecoder::new(part).read_to_end(&mut bytes).expect("a whole block");
            let expected = if block + 1 == count && word(2) > 0 { word(2) } else { word(1) };
            assert_eq!(bytes.len() - before, expected, "block {block} of {count}");
            place += word(3 + block);
        }
        bytes
    }

    fn written(facts: &[VtpFact], positions: VtpNumbers<'_>, triangles: &[[u32; 3]]) -> Vec<u8> {
        let points = VtpArray::new("Points", 3, positions);
        let count = triangles.len() + 1;
        let cell_data = [VtpArray::new("body", 1, VtpNumbers::I32(&vec![7; count]))];
        let [vertices, lines] = [VtpCells::new(&[[0]]), VtpCells::new::<2>(&[])];
        let triangles = VtpCells::new(triangles);
        let file = VtpFile {
            facts,
            points: &points,
            point_data: &[],
            cell_data: &cell_data,
            vertices: &vertices,
            lines: &lines,
            triangles: &triangles,
        };
        let mut bytes = Vec::new();
        write_vtp(&file, &mut bytes).expect("memory takes it");
        bytes
    }

    #[test]
    fn an_array_of_many_blocks_is_read_back_to_the_bit() {
        for count in [1, BLOCK / 4 / 3, BLOCK / 4, 3 * BLOCK / 4 + 5] {
            let numbers: Vec<f32> = (0..3 * count).map(|i| (i as f32 * 0.37).sin() * 2e4).collect();
            let file = written(&[], VtpNumbers::F32(&numbers), &[[0, 0, 0]]);
            let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
            assert!(read(&file, "<DataArray type=\"Float32\" Name=\"Points\"") == bytes, "{count} points");
        }
        let numbers = [0.1, -0.0, f64::MIN_POSITIVE / 8.0, f64::MAX, 1.0 / 3.0, 2e4];
        let file = written(&[], VtpNumbers::F64(&numbers), &[[0, 1, 0], [1, 0, 1]]);
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        assert_eq!(read(&file, "<DataArray type=\"Float64\" Name=\"Points\""), bytes);
        let bodies = read(&file, "<DataArray type=\"Int32\" Name=\"body\"");
        assert_eq!(bodies, [7, 0, 0, 0].repeat(3));
    }

    #[test]
    fn a_file_has_the_elements_that_readers_look_for() {
        let facts = [
            ("TimeValue", VtpTold::Numbers(1, vec![0.1])),
            ("force", VtpTold::Numbers(3, vec![1.0, -0.5, 1e21, 0.0, 0.0, 2.0])),
            ("gone", VtpTold::Numbers(1, vec![f64::NAN])),
            ("step", VtpTold::Counts(vec![12])),
            ("a<b", VtpTold::Texts(vec!["é".to_owned(), String::new()])),
        ]
        .map(|(name, told)| VtpFact { name: name.to_owned(), told });
        let file = written(&facts, VtpNumbers::F32(&[0.0; 9]), &[[0, 1, 2], [2, 1, 0]]);
        let text = String::from_utf8_lossy(&file);
        let head = text.split("<AppendedData").next().expect("a head");
        let lines: Vec<&str> = head.lines().collect();
        assert_eq!(
            lines[..9],
            [
                "<?xml version=\"1.0\"?>",
                "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt32\" \
                 compressor=\"vtkZLibDataCompressor\">",
                "<PolyData>",
                "<FieldData>",
                "<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfComponents=\"1\" NumberOfTuples=\"1\" \
                 format=\"ascii\">0.1</DataArray>",
                "<DataArray type=\"Float64\" Name=\"force\" NumberOfComponents=\"3\" NumberOfTuples=\"2\" \
                 format=\"ascii\">1 -0.5 1000000000000000000000 0 0 2</DataArray>",
                "<DataArray type=\"UInt64\" Name=\"step\" NumberOfTuples=\"1\" format=\"ascii\">12</DataArray>",
                "<Array type=\"String\" Name=\"a&lt;b\" NumberOfTuples=\"2\" format=\"ascii\">195 169 0 0</Array>",
                "</FieldData>",
            ]
        );
        assert_eq!(
            lines[9],
            "<Piece NumberOfPoints=\"3\" NumberOfVerts=\"1\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"2\">"
        );
        // What there is none of has no arrays.
        let sections = ["<Verts>", "<Lines>", "<Strips>", "<Polys>"]
            .map(|name| lines.iter().position(|line| *line == name).expect("a section"));
        assert_eq!([1, 2, 3].map(|next| sections[next] - sections[next - 1]), [4, 2, 2]);
        assert!(file.ends_with(b"\n</AppendedData>\n</VTKFile>\n"));
        let again = written(&facts, VtpNumbers::F32(&[0.0; 9]), &[[0, 1, 2], [2, 1, 0]]);
        assert!(file == again, "the same bytes");
    }
}
