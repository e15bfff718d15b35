//! Reading PLY: ASCII and binary of both byte orders, any elements and properties.
use super::Mesh;
use alloc::{
    format,
    string::{String, ToString},
    vec::Vec,
};

/// Why PLY bytes could not be read: `what` was `found`, `expected` would do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("PLY {what}: found {found}, expected {expected}")]
pub struct PlyError {
    /// The part of the file, for example `header line 4` or `vertex 17`.
    pub what: String,
    /// What was there.
    pub found: String,
    /// What should be there.
    pub expected: String,
}

fn error<T>(what: impl ToString, found: impl ToString, expected: &str) -> Result<T, PlyError> {
    let (what, found) = (what.to_string(), found.to_string());
    Err(PlyError { what, found, expected: expected.into() })
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Scalar> {
        Some(match name {
            "char" | "int8" => Scalar::I8,
            "uchar" | "uint8" => Scalar::U8,
            "short" | "int16" => Scalar::I16,
            "ushort" | "uint16" => Scalar::U16,
            "int" | "int32" => Scalar::I32,
            "uint" | "uint32" => Scalar::U32,
            "float" | "float32" => Scalar::F32,
            "double" | "float64" => Scalar::F64,
            _ => return None,
        })
    }
}

struct Property {
    name: String,
    /// Type of the length, for a list.
    list: Option<Scalar>,
    scalar: Scalar,
}

struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

/// Reads a mesh. Understood: vertex x y z, nx ny nz, red green blue (uchar, or float in 0..1),
/// class or label; face vertex_indices or vertex_index, polygons cut into fans. Everything else
/// is skipped. Memory stays in proportion to the bytes given, whatever the header claims.
///
/// # Errors
/// [`PlyError`] names the header line or the element at fault.
pub fn read_ply(bytes: &[u8]) -> Result<Mesh, PlyError> {
    let (format, elements, body) = read_header(bytes)?;
    let mut reader = Reader { format, bytes: body, at: 0 };
    let mut mesh = Mesh::default();
    let mut has_vertices = false;
    for element in &elements {
        match element.name.as_str() {
            "vertex" if !has_vertices => {
                read_vertices(&mut reader, element, &mut mesh)?;
                has_vertices = true;
            }
            "face" => read_faces(&mut reader, element, &mut mesh)?,
            _ => {
                for i in 0..element.count {
                    for p in &element.properties {
                        reader.skip(p).or_else(|e| e.at(&element.name, i))?;
                    }
                }
            }
        }
    }
    if !has_vertices {
        return error("header", "no element vertex", "element vertex");
    }
    let n = mesh.positions.len();
    if let Some((t, _)) =
        mesh.triangles.iter().enumerate().find(|(_, t)| t.iter().any(|&i| i as usize >= n))
    {
        return error(
            format!("triangle {t}"),
            format!("vertex indices {:?}", mesh.triangles[t]),
            &format!("less than {n}"),
        );
    }
    Ok(mesh)
}

/// Header lines, then where the body begins.
fn read_header(bytes: &[u8]) -> Result<(Format, Vec<Element>, &[u8]), PlyError> {
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut at = 0;
    for number in 1.. {
        let what = || format!("header line {number}");
        let rest = &bytes[at..];
        // A header line of more than this is no header.
        let Some(end) = rest.iter().take(4096).position(|&b| b == b'\n') else {
            return error(what(), "no end of the header", "a line `end_header`");
        };
        at += end + 1;
        let Ok(line) = core::str::from_utf8(&rest[..end]) else {
            return error(what(), "bytes that are not text", "text");
        };
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match (number, words.as_slice()) {
            (1, ["ply"]) => {}
            (1, _) => return error(what(), short(line), "`ply`"),
            (_, [] | ["comment" | "obj_info", ..]) => {}
            (_, ["format", name, _]) => {
                format = Some(match *name {
                    "ascii" => Format::Ascii,
                    "binary_little_endian" => Format::LittleEndian,
                    "binary_big_endian" => Format::BigEndian,
                    _ => {
                        let expected = "ascii, binary_little_endian or binary_big_endian";
                        return error(what(), short(name), expected);
                    }
                });
            }
            (_, ["element", name, count]) => match count.parse() {
                Ok(count) => {
                    elements.push(Element { name: name.to_string(), count, properties: Vec::new() })
                }
                Err(_) => return error(what(), short(count), "a number of elements"),
            },
            (_, ["property", kind @ .., name]) => {
                let (list, scalar) = match kind {
                    ["list", length, scalar] => {
                        (Some(Scalar::parse(length)), Scalar::parse(scalar))
                    }
                    [scalar] => (None, Scalar::parse(scalar)),
                    _ => (None, None),
                };
                let (Some(scalar), Some(element), false) =
                    (scalar, elements.last_mut(), matches!(list, Some(None)))
                else {
                    return error(what(), short(line), "a property with known types in an element");
                };
                let list = list.flatten();
                element.properties.push(Property { name: name.to_string(), list, scalar });
            }
            (_, ["end_header"]) => break,
            _ => return error(what(), short(line), "format, element, property or end_header"),
        }
    }
    let Some(format) = format else {
        return error("header", "no format line", "a line `format`");
    };
    // Every element takes at least a byte, which bounds all loops and all memory below.
    for e in &elements {
        if e.count > bytes.len() - at || (e.count > 0 && e.properties.is_empty()) {
            let found = format!(
                "{} elements of {} properties in {} bytes",
                e.count,
                e.properties.len(),
                bytes.len() - at
            );
            return error(format!("element {}", short(&e.name)), found, "at least a byte for each");
        }
    }
    Ok((format, elements, &bytes[at..]))
}

fn short(text: &str) -> String {
    format!("`{}`", text.trim().chars().take(60).collect::<String>())
}

/// Why a value could not be read, before it is known whose it was.
struct BadValue {
    found: String,
    expected: &'static str,
}

impl BadValue {
    fn at<T>(self, element: &str, index: usize) -> Result<T, PlyError> {
        error(format!("{} {index}", short(element)), self.found, self.expected)
    }
}

struct Reader<'a> {
    format: Format,
    bytes: &'a [u8],
    at: usize,
}

impl Reader<'_> {
    fn fixed<const N: usize>(&mut self) -> Result<[u8; N], BadValue> {
        let Some(b) = self.bytes.get(self.at..).and_then(|b| b.first_chunk::<N>()) else {
            return Err(BadValue {
                found: format!("the end of the file after {} bytes of data", self.bytes.len()),
                expected: "more data",
            });
        };
        self.at += N;
        let mut b = *b;
        if self.format == Format::BigEndian {
            b.reverse();
        }
        Ok(b)
    }

    fn value(&mut self, scalar: Scalar) -> Result<f64, BadValue> {
        if self.format == Format::Ascii {
            return self.word();
        }
        Ok(match scalar {
            Scalar::I8 => f64::from(i8::from_le_bytes(self.fixed()?)),
            Scalar::U8 => f64::from(u8::from_le_bytes(self.fixed()?)),
            Scalar::I16 => f64::from(i16::from_le_bytes(self.fixed()?)),
            Scalar::U16 => f64::from(u16::from_le_bytes(self.fixed()?)),
            Scalar::I32 => f64::from(i32::from_le_bytes(self.fixed()?)),
            Scalar::U32 => f64::from(u32::from_le_bytes(self.fixed()?)),
            Scalar::F32 => f64::from(f32::from_le_bytes(self.fixed()?)),
            Scalar::F64 => f64::from_le_bytes(self.fixed()?),
        })
    }

    fn word(&mut self) -> Result<f64, BadValue> {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let start = rest.iter().take_while(|b| b.is_ascii_whitespace()).count();
        let len = rest[start..].iter().take_while(|b| !b.is_ascii_whitespace()).count();
        self.at += start + len;
        let text = core::str::from_utf8(&rest[start..start + len]).unwrap_or("?");
        let bad = BadValue { found: short(text), expected: "a number" };
        text.parse().map_err(|_| bad)
    }

    /// Returns the length of a list. It may not exceed what is left: each value takes at least a byte.
    fn length(&mut self, scalar: Scalar) -> Result<usize, BadValue> {
        let n = self.value(scalar)?;
        let left = (self.bytes.len() - self.at.min(self.bytes.len())) as f64;
        // Written so that NaN fails; fractions are refused too.
        if n >= 0.0 && n <= left && n == n as usize as f64 {
            return Ok(n as usize);
        }
        Err(BadValue { found: format!("a list of {n}"), expected: "a length that fits the file" })
    }

    fn skip(&mut self, p: &Property) -> Result<(), BadValue> {
        let n = p.list.map_or(Ok(1), |scalar| self.length(scalar))?;
        for _ in 0..n {
            self.value(p.scalar)?;
        }
        Ok(())
    }
}

/// What a vertex property means: a slot of the row x y z nx ny nz red green blue class.
fn vertex_slot(p: &Property) -> Option<usize> {
    const NAMES: [&str; 10] = ["x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "class"];
    let name = match p.name.as_str() {
        "label" => "class",
        "r" => "red",
        "g" => "green",
        "b" => "blue",
        name => name,
    };
    NAMES.iter().position(|n| *n == name).filter(|_| p.list.is_none())
}

fn read_vertices(
    reader: &mut Reader<'_>,
    element: &Element,
    mesh: &mut Mesh,
) -> Result<(), PlyError> {
    let slots: Vec<Option<usize>> = element.properties.iter().map(vertex_slot).collect();
    let has = |range: core::ops::Range<usize>| range.into_iter().all(|s| slots.contains(&Some(s)));
    if !has(0..3) {
        return error("element vertex", "no x, y, z", "properties x, y and z");
    }
    let (normals, colors, classes) = (has(3..6), has(6..9), has(9..10));
    let float_color = element
        .properties
        .iter()
        .zip(&slots)
        .any(|(p, s)| matches!(s, Some(6..9)) && matches!(p.scalar, Scalar::F32 | Scalar::F64));
    let scale = if float_color { 255.0 } else { 1.0 };
    for i in 0..element.count {
        let mut row = [0f64; 10];
        for (p, slot) in element.properties.iter().zip(&slots) {
            match slot {
                Some(s) => row[*s] = reader.value(p.scalar).or_else(|e| e.at("vertex", i))?,
                None => reader.skip(p).or_else(|e| e.at("vertex", i))?,
            }
        }
        let triple = |s: usize| [row[s] as f32, row[s + 1] as f32, row[s + 2] as f32];
        mesh.positions.push(triple(0));
        if normals {
            mesh.normals.push(triple(3));
        }
        if colors {
            // `as` saturates, and turns NaN into 0; half up, so that 0..1 floats round trip.
            mesh.colors.push([6, 7, 8].map(|s| (row[s] * scale + 0.5) as u8));
        }
        if classes {
            // Ids that no compact index can be are unlabelled.
            let class = if row[9] >= 0.0 && row[9] < 255.0 { row[9] as u8 } else { 255 };
            mesh.classes.push(class);
        }
    }
    Ok(())
}

fn read_faces(reader: &mut Reader<'_>, element: &Element, mesh: &mut Mesh) -> Result<(), PlyError> {
    let is_indices =
        |p: &Property| p.list.is_some() && matches!(&*p.name, "vertex_indices" | "vertex_index");
    for i in 0..element.count {
        for p in &element.properties {
            let Some(length) = p.list.filter(|_| is_indices(p)) else {
                reader.skip(p).or_else(|e| e.at("face", i))?;
                continue;
            };
            let n = reader.length(length).or_else(|e| e.at("face", i))?;
            let mut fan = [0; 2];
            for corner in 0..n {
                let v = reader.value(p.scalar).or_else(|e| e.at("face", i))?;
                if !(v >= 0.0 && v < f64::from(u32::MAX) && v == v as u32 as f64) {
                    return error(format!("face {i}"), format!("vertex index {v}"), "an index");
                }
                match corner {
                    0 | 1 => fan[corner] = v as u32,
                    _ => {
                        mesh.triangles.push([fan[0], fan[1], v as u32]);
                        fan[1] = v as u32;
                    }
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{test_shapes::square, write_ply};
    use alloc::vec;

    fn full_mesh() -> Mesh {
        let mut m = square(3, 1.5, 0.25);
        m.compute_normals();
        m.colors = (0..16).map(|i| [i, 2 * i, 255 - i]).collect();
        m.classes = (0..16).map(|i| if i == 3 { 255 } else { i }).collect();
        m
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut m = full_mesh();
        assert_eq!(read_ply(&write_ply(&m).unwrap()).unwrap(), m);
        m.classes.clear();
        m.normals.clear();
        assert_eq!(read_ply(&write_ply(&m).unwrap()).unwrap(), m);
        m.colors.pop();
        assert!(write_ply(&m).is_err());
        assert_eq!(read_ply(&write_ply(&Mesh::default()).unwrap()).unwrap(), Mesh::default());
    }

    #[test]
    fn ascii_polygons_and_unknown_parts() {
        let text = "ply\r\nformat ascii 1.0\r\ncomment hi\r\nelement camera 1\r\n\
            property list uchar float k\r\nelement vertex 5\r\nproperty double x\r\n\
            property float y\r\nproperty float z\r\nproperty float red\r\nproperty float green\r\n\
            property float blue\r\nproperty int quality\r\nelement face 2\r\n\
            property uchar flags\r\nproperty list uchar uint vertex_index\r\nend_header\r\n\
            3 1 2 3\r\n0 0 0 1 0.5 0 7\r\n1 0 0 0 0 0 7\r\n1 1 0 0 0 0 7\r\n0 1 0 0 0 0 7\r\n\
            0 2 0 0 0 0 7\r\n9 5 0 1 2 3 4\r\n9 2 0 1\r\n";
        let m = read_ply(text.as_bytes()).unwrap();
        assert_eq!(m.positions.len(), 5);
        assert_eq!(m.colors[0], [255, 128, 0]);
        assert_eq!(m.triangles, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
    }

    #[test]
    fn big_endian_is_read() {
        let mut b = b"ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\n\
            property float y\nproperty float z\nelement face 1\n\
            property list uchar short vertex_indices\nend_header\n"
            .to_vec();
        for i in 0..9 {
            b.extend_from_slice(&(i as f32 * 1.5).to_be_bytes());
        }
        b.push(3);
        for i in [2i16, 0, 1] {
            b.extend_from_slice(&i.to_be_bytes());
        }
        let m = read_ply(&b).unwrap();
        assert_eq!(m.positions[2], [9.0, 10.5, 12.0]);
        assert_eq!(m.triangles, [[2, 0, 1]]);
    }

    #[test]
    fn hostile_files_are_refused_without_panic() {
        let header = |body: &str| format!("ply\nformat ascii 1.0\n{body}end_header\n");
        let xyz = "property float x\nproperty float y\nproperty float z\n";
        let cases = [
            String::new(),
            "ply".into(),
            "ply\nformat pdf 1.0\nend_header\n".into(),
            "ply\nend_header\n".into(),
            header(""),
            header("property float x\n"),
            header("element vertex -1\n"),
            header(&format!("element vertex 18446744073709551615\n{xyz}")),
            header("element nothing 9999999999\n"),
            header("element vertex 1\nproperty quux x\n"),
            header("element vertex 1\nproperty list quux float x\n"),
            header(&format!("element vertex 1\n{xyz}")) + "1 2\n",
            header(&format!("element vertex 1\n{xyz}")) + "1 2 abc\n",
            header(&format!(
                "element vertex 1\n{xyz}element face 1\nproperty list int int vertex_indices\n"
            )) + "1 2 3\n-5 1 2 3\n",
            header(&format!(
                "element vertex 1\n{xyz}element face 1\nproperty list float int vertex_indices\n"
            )) + "1 2 3\n1e30 1 2 3\n",
            header(&format!(
                "element vertex 1\n{xyz}element face 1\nproperty list int int vertex_indices\n"
            )) + "1 2 3\n3 0 0 1\n",
            header(&format!(
                "element vertex 1\n{xyz}element face 1\nproperty list int int vertex_indices\n"
            )) + "1 2 3\n3 0 0 -1\n",
        ];
        for (i, case) in cases.iter().enumerate() {
            let e = read_ply(case.as_bytes());
            assert!(e.is_err(), "case {i}");
            assert!(!e.unwrap_err().to_string().is_empty());
        }
        // Every truncation and many single-byte changes of a good file.
        let good = write_ply(&full_mesh()).unwrap();
        for n in 0..good.len() {
            assert!(read_ply(&good[..n]).is_err(), "{n} bytes");
        }
        for i in 0..good.len() {
            for change in [0x01, 0x10, 0x80, 0xff] {
                let mut bad = good.clone();
                bad[i] ^= change;
                let _ = read_ply(&bad);
            }
        }
        let mut binary = vec![0u8; 64];
        binary[..4].copy_from_slice(b"ply\n");
        assert!(read_ply(&binary).is_err());
    }
}
