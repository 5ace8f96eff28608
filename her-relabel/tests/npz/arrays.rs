//! Arrays that are read, and those that are refused.

use std::collections::BTreeMap;
use std::io::{Cursor, Read, Write};

use her_relabel::{HerBuffer, NpzError};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::common::{Result, config, exported, filled};

/// An archive with some arrays replaced or left out.
fn changed(replaced: &[(&str, Option<Vec<u8>>)]) -> Vec<u8> {
    let bytes = exported(&filled::<f64>(50, 3));
    let mut archive = ZipArchive::new(Cursor::new(&bytes)).unwrap();
    let mut arrays = BTreeMap::new();
    for at in 0..archive.len() {
        let mut file = archive.by_index(at).unwrap();
        let mut array = Vec::new();
        file.read_to_end(&mut array).unwrap();
        arrays.insert(file.name().unwrap().trim_end_matches(".npy").to_owned(), Some(array));
    }
    for (name, array) in replaced {
        arrays.insert((*name).to_owned(), array.clone());
    }
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, array) in arrays {
        if let Some(array) = array {
            writer.start_file(format!("{name}.npy"), options).unwrap();
            writer.write_all(&array).unwrap();
        }
    }
    writer.finish().unwrap().into_inner()
}

/// An array with any header.
fn array(version: u8, header: &str, data: &[u8]) -> Vec<u8> {
    let len = u32::try_from(header.len()).unwrap().to_le_bytes();
    let len = if version == 1 { &len[..2] } else { &len[..] };
    [b"\x93NUMPY", &[version, 0][..], len, header.as_bytes(), data].concat()
}

pub(crate) fn plain(dtype: &str, shape: &str, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}\n");
    array(1, &header, data)
}

/// Imports into a buffer that is not empty, and checks that an error changes nothing.
fn refusal(bytes: &[u8]) -> Option<NpzError> {
    let mut buffer = filled::<f64>(50, 2);
    let before = (buffer.transition_ids(), buffer.num_episodes());
    let result = buffer.import_npz_bytes(bytes);
    let error = result.err();
    if error.is_some() {
        // Numbers of transitions are never reused.
        assert_eq!((buffer.transition_ids(), buffer.num_episodes()), before);
    }
    error
}

#[test]
fn a_foreign_or_damaged_archive_is_refused() -> Result {
    assert!(refusal(&changed(&[])).is_none());
    let bytes = exported(&filled::<f64>(50, 1));
    for len in (0..bytes.len()).step_by(11) {
        assert!(refusal(&bytes[..len]).is_some(), "{len} bytes");
    }
    let mut unharmed = 0;
    for at in 0..bytes.len() {
        let mut damaged = bytes.clone();
        damaged[at] ^= 0x11;
        let mut buffer = HerBuffer::<f64>::new(config(50))?;
        if buffer.import_npz_bytes(&damaged).is_ok() {
            // A time or an attribute of the archive; the episodes are the same.
            assert_eq!(exported(&buffer), bytes, "byte {at}");
            unharmed += 1;
        }
    }
    assert!(unharmed < bytes.len() / 2, "{unharmed} of {}", bytes.len());
    assert!(matches!(refusal(b"not an archive"), Some(NpzError::Archive(_))));
    Ok(())
}

#[test]
fn arrays_that_do_not_fit_are_named() -> Result {
    let error = |name: &'static str, array| refusal(&changed(&[(name, array)])).unwrap();
    let missing = error("actions", None);
    assert!(matches!(&missing, NpzError::Missing { array } if array == "actions"));
    let missing = error("fields_latent", None);
    assert!(missing.to_string().contains("`fields_latent`"));
    let typed = error("rewards", Some(plain("<i8", "6,", &[0; 48])));
    assert!(matches!(&typed, NpzError::Type { actual, .. } if actual == "'<i8'"), "{typed}");
    let typed = error("terminated", Some(plain("<f8", "3,", &[0; 24])));
    assert!(matches!(typed, NpzError::Type { expected: "bool", .. }), "{typed}");
    let shape = error("observations", Some(plain("<f8", "9, 3", &[0; 216])));
    assert!(matches!(shape, NpzError::Shape { rows: 9, width: 2, .. }), "{shape}");
    let shape = error("truncated", Some(plain("|b1", "2,", &[0; 2])));
    assert!(matches!(shape, NpzError::Shape { rows: 3, width: 1, .. }), "{shape}");
    let short = error("actions", Some(plain("<f8", "6, 1", &[0; 40])));
    assert!(matches!(&short, NpzError::Array { array, .. } if array == "actions"), "{short}");
    let long = error("actions", Some(plain("<f8", "6, 1", &[0; 49])));
    assert!(matches!(&long, NpzError::Array { .. }), "{long}");
    let nan = f64::NAN.to_le_bytes().repeat(6);
    let nan = error("actions", Some(plain("<f8", "6, 1", &nan)));
    assert!(matches!(nan, NpzError::Episode { episode: 0, .. }), "{nan}");
    let huge = 1e30_f64.to_le_bytes().repeat(6);
    let huge = error("rewards", Some(plain("<f8", "6,", &huge)));
    assert!(matches!(huge, NpzError::Episode { episode: 0, .. }), "{huge}");
    let lengths = |lengths: [i64; 3]| lengths.map(i64::to_le_bytes).concat();
    for wrong in [[1, 2, 4], [1, 0, 5], [-1, 3, 4], [1, 2, 2], [i64::MAX, 1, 1]] {
        let wrong = error("episode_lengths", Some(plain("<i8", "3,", &lengths(wrong))));
        assert!(matches!(wrong, NpzError::Lengths { expected: 6, .. }), "{wrong}");
    }
    let other = plain("<i8", "3,", &lengths([3, 2, 1]));
    assert!(refusal(&changed(&[("episode_lengths", Some(other))])).is_none());
    Ok(())
}

#[test]
fn every_form_that_numpy_writes_is_read() -> Result {
    let lengths = [1_i32, 2, 3].map(i32::to_le_bytes).concat();
    let numbers = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].map(f64::to_le_bytes).concat();
    let fortran = |shape: &str| {
        let header = format!("{{'descr': '<f8', 'fortran_order': True, 'shape': ({shape}), }}\n");
        array(1, &header, &numbers)
    };
    let padded = |len: usize| {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (6, 1), }";
        array(1, &format!("{header:<width$}\n", width = len - 1), &numbers)
    };
    let with_dimensions =
        |count: usize| plain("<f8", &format!("6{}", ", 1".repeat(count)), &numbers);
    let second = "{'descr': '<f8', 'fortran_order': False, 'shape': (6, 1), }\n";
    for (name, array) in [
        ("episode_lengths", plain("<i4", "3,", &lengths)),
        // One dimension has no order.
        ("rewards", fortran("6,")),
        ("actions", array(2, second, &numbers)),
        ("actions", array(3, second, &numbers)),
        ("actions", padded(1024)),
        ("actions", with_dimensions(30)),
    ] {
        let error = refusal(&changed(&[(name, Some(array))]));
        assert!(error.is_none(), "{name}: {error:?}");
    }
    for (name, array) in [("actions", fortran("6, 1")), ("actions", padded(1025))] {
        let error = refusal(&changed(&[(name, Some(array))]));
        assert!(matches!(error, Some(NpzError::Array { .. })), "{name}: {error:?}");
    }
    Ok(())
}

#[test]
fn hostile_headers_are_refused() -> Result {
    let huge = "4611686018427387904";
    for (name, header) in [
        ("rewards", plain("<f8", &format!("{huge},"), &[0; 8])),
        ("actions", plain("<f8", &format!("{huge}, {huge}"), &[0; 8])),
        ("actions", plain("<f8", "-6, 1", &[0; 48])),
        ("actions", plain("<f8", "", &[0; 48])),
        ("actions", plain("O", "6, 1", &[0; 48])),
        ("actions", plain("<f9999999999999999", "6, 1", &[0; 48])),
        ("actions", array(1, &"[".repeat(60_000), &[])),
        ("actions", array(1, &"{".repeat(900), &[])),
        ("actions", array(2, "", &[255; 4])),
        ("actions", array(9, "{}", &[])),
        ("actions", b"\x93NUMPY\x02\x00\xff\xff\xff\xff".to_vec()),
        ("actions", b"PK".to_vec()),
    ] {
        assert!(refusal(&changed(&[(name, Some(header.clone()))])).is_some(), "{header:?}");
    }
    // Arrays that claim the same size and do not have it: an archive bomb of zeros.
    let steps = 1_u64 << 40;
    let lengths = plain("<i8", "1,", &(steps as i64).to_le_bytes());
    let matrix =
        |rows: u64, width: u64| Some(plain("<f8", &format!("{rows}, {width}"), &[0; 1 << 16]));
    let bomb = changed(&[
        ("episode_lengths", Some(lengths)),
        ("observations", matrix(steps + 1, 2)),
        ("achieved_goals", matrix(steps + 1, 1)),
        ("desired_goals", matrix(1, 1)),
        ("actions", matrix(steps, 1)),
        ("rewards", matrix(steps, 1)),
        ("fields_log_prob", matrix(steps, 1)),
        ("fields_latent", matrix(steps, 2)),
        ("terminated", Some(plain("|b1", "1,", &[1]))),
        ("truncated", Some(plain("|b1", "1,", &[1]))),
    ]);
    let error = refusal(&bomb).unwrap();
    assert!(matches!(&error, NpzError::Array { array, .. } if array == "observations"), "{error}");
    Ok(())
}
