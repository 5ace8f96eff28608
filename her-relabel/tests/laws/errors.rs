//! The output of a program whose `main` returns an error.

use std::error::Error;
use std::io;

use her_relabel::{
    AddError, ConfigError, LoadError, MixtureError, NormalizerError, PriorityError, SampleError,
    UnitInterval, UnknownField,
};

use crate::common::{Result, buffer};

#[test]
fn errors_print_their_message_for_debugging_too() -> Result {
    let unknown: UnknownField = her_relabel::Batch::<f32>::new().field("value").unwrap_err();
    let errors: [&dyn Error; 9] = [
        &AddError::NoEpisode { env_index: 1 },
        &ConfigError::Zero { name: "capacity" },
        &LoadError::Io(io::Error::other("unplugged")),
        &MixtureError::PartCount { count: 0 },
        &NormalizerError::NotFinite { index: 1, value: f64::NAN },
        &PriorityError::NoPriorities,
        &SampleError::NoFinishedEpisode,
        &UnitInterval::new(2.0).unwrap_err(),
        &unknown,
    ];
    for error in errors {
        assert_eq!(format!("{error:?}"), error.to_string());
    }
    let error: Box<dyn Error> = buffer(1).end_episode(0).unwrap_err().into();
    assert!(format!("{error:?}").contains("call begin_episode after every reset"));
    #[cfg(feature = "npz")]
    {
        let error = her_relabel::NpzError::Missing { array: "rewards".into() };
        assert_eq!(format!("{error:?}"), error.to_string());
    }
    Ok(())
}
