use super::*;

/// Returns a NumPy file as `numpy.save` writes it.
pub fn npy(dtype: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let mut header =
        format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}");
    while !(10 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut out = b"\x93NUMPY\x01\x00".to_vec();
    out.extend((header.len() as u16).to_le_bytes());
    out.extend(header.bytes());
    out.extend(data);
    out
}

/// C x h x w of float32, value i at index i.
pub fn ramp(channels: usize, height: usize, width: usize) -> Vec<u8> {
    let data: Vec<u8> =
        (0..channels * height * width).flat_map(|i| (i as f32).to_le_bytes()).collect();
    npy("<f4", &format!("{channels}, {height}, {width}"), &data)
}

#[test]
fn both_float_formats_are_read() {
    let map = parse(&ramp(2, 3, 4), "a.npy", 0).unwrap();
    assert_eq!((map.channels, map.height, map.width), (2, 3, 4));
    assert_eq!(map.values, (0..24).map(|i| i as f32).collect::<Vec<_>>());
    let bits = [0x3c00_u16, 0xc000, 0x3555, 0x0001, 0x7bff, 0x8000];
    let data: Vec<u8> = bits.iter().flat_map(|b| b.to_le_bytes()).collect();
    let map = parse(&npy("<f2", "1, 2, 3", &data), "a.npy", 0).unwrap();
    assert_eq!(map.values, [1.0, -2.0, 0.333_251_95, 5.960_464_5e-8, 65504.0, 0.0]);
}

#[test]
fn what_is_no_feature_map_is_named() {
    let error = |bytes: &[u8]| parse(bytes, "features/000007.npy", 7).unwrap_err().to_string();
    let good = ramp(2, 3, 4);
    let fortran = String::from_utf8_lossy(&good).contains("False");
    assert!(fortran);
    let infinite: Vec<u8> = [1.0, f32::INFINITY].iter().flat_map(|x| x.to_le_bytes()).collect();
    for (bytes, parts) in [
        (b"PNG".to_vec(), ["feature map", "no NumPy file"]),
        (good[..20].to_vec(), ["NumPy header", "ends early"]),
        (good[..good.len() - 4].to_vec(), ["bytes", "found 92, expected 96"]),
        (npy("<f8", "1, 1, 1", &[0; 8]), ["dtype", "found <f8, expected <f4"]),
        (npy("<i4", "1, 1, 1", &[0; 4]), ["dtype", "<i4"]),
        (npy("<f4", "3, 4", &[0; 48]), ["shape", "(channels, height, width)"]),
        (npy("<f4", "0, 3, 4", &[]), ["shape", "found (0, 3, 4)"]),
        (npy("<f4", "5000, 1, 1", &[0; 20_000]), ["shape", "4096"]),
        (npy("<f4", "2, 1, 1", &infinite), ["values", "inf at index 1"]),
        // In 32 bits these sizes have a product of 0.
        (npy("<f4", "4096, 4096, 4096", &[]), ["bytes", "found 0, expected 274877906944"]),
        (npy("<f4", "9999999999999999999999, 1, 1", &[]), ["shape", "none of them 0"]),
        (npy(&"x".repeat(5000), "1, 1, 1", &[]), ["dtype", &"x".repeat(40)]),
        (b"\x93NUMPY\x02\0\xff\xff\xff\xff".to_vec(), ["NumPy header", "at most 65535"]),
    ] {
        let text = error(&bytes);
        assert!(text.contains("features/000007.npy (frame 7)"), "{text}");
        assert!(parts.iter().all(|p| text.contains(p)), "{text}: {parts:?}");
    }
    // A byte more or less anywhere is an error or a map, never a panic.
    for cut in 0..good.len() {
        let _ = parse(&good[..cut], "a.npy", 0);
    }
}

/// Returns a safetensors file with this header.
pub fn tensors(header: &str, data: &[u8]) -> Vec<u8> {
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), data].concat()
}

#[test]
fn safetensors_with_one_tensor_or_a_named_one_are_read() {
    let read = |header: &str, data: &[u8]| parse(&tensors(header, data), "a.safetensors", 0);
    let data: Vec<u8> = (0..24).flat_map(|i| (i as f32).to_le_bytes()).collect();
    let one = r#""dtype":"F32","shape":[2,3,4],"data_offsets":[0,96]"#;
    let map = read(&format!(r#"{{"__metadata__":{{"by":"x"}},"any":{{{one}}}}}"#), &data).unwrap();
    assert_eq!((map.channels, map.height, map.width), (2, 3, 4));
    assert_eq!(map.values, (0..24).map(|i| i as f32).collect::<Vec<_>>());
    // The one with the name, wherever it lies.
    let header = format!(
        r#"{{"a":{{"dtype":"BF16","shape":[3],"data_offsets":[100,106]}},"features":{{"dtype":"F16",
            "shape":[1,1,2],"data_offsets":[96,100]}},"z":{{{one}}}}}"#
    );
    let halves = [0x3c00_u16, 0xc000].map(u16::to_le_bytes).concat();
    let map = read(&header, &[&data, halves.as_slice(), &[0; 6]].concat()).unwrap();
    assert_eq!(((map.channels, map.height, map.width), map.values), ((1, 1, 2), vec![1.0, -2.0]));
}

#[test]
fn what_is_no_safetensors_feature_map_is_named() {
    let file = "features/000007.safetensors";
    let error = |bytes: &[u8]| parse(bytes, file, 7).unwrap_err().to_string();
    let described = |dtype: &str, shape: &str, end: usize| {
        format!(r#"{{"a":{{"dtype":"{dtype}","shape":[{shape}],"data_offsets":[0,{end}]}}}}"#)
    };
    let only =
        |dtype: &str, shape: &str, n: usize| tensors(&described(dtype, shape, n), &vec![0; n]);
    let claims = |shape: &str, offsets: &str| {
        let text =
            format!(r#"{{"a":{{"dtype":"F32","shape":[{shape}],"data_offsets":[{offsets}]}}}}"#);
        tensors(&text, &[0; 8])
    };
    let two = r#"{"a":{"dtype":"U8","shape":[1],"data_offsets":[0,1]},
        "b":{"dtype":"U8","shape":[1],"data_offsets":[1,2]}}"#;
    let same = two.replace("1,2", "0,1");
    let infinite = f32::NAN.to_le_bytes();
    for (bytes, parts) in [
        (b"PNG".to_vec(), ["feature map: file", "found 3 bytes"]),
        (u64::MAX.to_le_bytes().to_vec(), ["header", "at most 1048576"]),
        (9u64.to_le_bytes().to_vec(), ["header", "found 0 bytes, expected 9"]),
        (tensors("{]", &[]), ["header", "expected JSON"]),
        (tensors("{}", &[]), ["tensors", "found 0 ()"]),
        (tensors(two, &[0; 2]), ["tensors", r#"found 2 ("a", "b"), expected one, or one named"#]),
        (tensors(&same, &[0; 1]), ["data_offsets", "do not overlap"]),
        (only("F64", "1,1,1", 8), ["dtype", r#"found "F64", expected F32"#]),
        (only("Q4", "1,1,1", 8), ["dtype", r#"found "Q4", expected one of"#]),
        (only("F32", "3,4", 48), ["shape", "found [3, 4], expected (channels, height, width)"]),
        (only("F32", "0,3,4", 0), ["shape", "none of them 0"]),
        (only("F32", "5000,1,1", 20_000), ["shape", "4096"]),
        (tensors(&described("F32", "1,1,1", 4), &infinite), ["values", "NaN at index 0"]),
        (claims("1,1,2", "0,9"), ["data", "cut off"]),
        (claims("1,1,2", "8,0"), ["data", "cut off"]),
        (claims("1,1,2", "0,18446744073709551615"), ["data", "cut off"]),
        (claims("1,1,2", "0,-1"), ["data_offsets", "two whole numbers"]),
        (claims("4294967296,4294967296,4", "0,8"), ["data", "found 8 bytes"]),
        (claims("1,1,1", "0,4"), ["file", "found 8 bytes of data, expected 4"]),
    ] {
        let text = error(&bytes);
        assert!(text.contains("features/000007.safetensors (frame 7)"), "{text}");
        assert!(parts.iter().all(|p| text.contains(p)), "{text}: {parts:?}");
    }
    let good = only("F16", "2,3,4", 48);
    for cut in 0..good.len() {
        assert!(parse(&good[..cut], file, 0).is_err(), "{cut}");
    }
}
