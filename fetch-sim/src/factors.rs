//! Numbers that may differ between episodes, by name.

/// Declares factors, with their names, what errors call them, and their bounds; and a set of their
/// values.
macro_rules! factors {
    (
        $(#[$factors_doc:meta])*
        $factors:ident {
            $(
                $(#[$doc:meta])*
                $factor:ident = $name:literal, $what:literal, [$least:literal, $most:literal];
            )*
        }
        $(#[$numbers_doc:meta])*
        $numbers:ident
    ) => {
        $(#[$factors_doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        pub enum $factors {
            $($(#[$doc])* $factor,)*
        }

        impl $factors {
            /// All factors.
            pub const ALL: &[Self] = &[$(Self::$factor),*];

            /// Returns the factor's name.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$factor => $name,)* }
            }

            /// Returns the smallest and the largest value: far wider than what makes sense in the
            /// scene, to catch numbers in other units.
            #[must_use]
            pub const fn bounds(self) -> [f64; 2] {
                match self { $(Self::$factor => [$least, $most],)* }
            }

            const fn what(self) -> &'static str {
                match self { $(Self::$factor => $what,)* }
            }
        }

        impl std::fmt::Display for $factors {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl std::str::FromStr for $factors {
            type Err = $crate::error::SimError;

            fn from_str(name: &str) -> Result<Self, Self::Err> {
                let mut factors = Self::ALL.iter().copied();
                let found = factors.find(|factor| factor.name() == name);
                found.ok_or_else(|| Self::Err::UnknownFactor {
                    name: name.into(),
                    known: &[$($name),*],
                })
            }
        }

        $(#[$numbers_doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(
            try_from = "std::collections::BTreeMap<String, f64>",
            into = "std::collections::BTreeMap<String, f64>"
        )]
        #[must_use]
        pub struct $numbers([Option<f64>; $factors::ALL.len()]);

        impl $numbers {
            /// Sets a number.
            ///
            /// # Errors
            /// [`SimError::OutOfRange`](crate::SimError::OutOfRange) outside of the factor's bounds.
            pub fn with(
                mut self,
                factor: $factors,
                value: f64,
            ) -> Result<Self, $crate::error::SimError> {
                $crate::bounds::check_between(factor.what(), value, factor.bounds())?;
                self.0[factor as usize] = Some(value);
                Ok(self)
            }

            /// Returns a number, if it differs from the model's.
            #[must_use]
            pub const fn get(&self, factor: $factors) -> Option<f64> {
                self.0[factor as usize]
            }

            /// Returns the numbers that are set.
            pub fn iter(&self) -> impl Iterator<Item = ($factors, f64)> + '_ {
                $factors::ALL.iter().filter_map(|&factor| Some((factor, self.get(factor)?)))
            }

            /// Returns whether nothing differs from the model.
            #[must_use]
            pub fn is_empty(&self) -> bool {
                self.iter().next().is_none()
            }
        }

        impl From<$numbers> for std::collections::BTreeMap<String, f64> {
            fn from(numbers: $numbers) -> Self {
                numbers.iter().map(|(factor, value)| (factor.to_string(), value)).collect()
            }
        }

        impl TryFrom<std::collections::BTreeMap<String, f64>> for $numbers {
            type Error = $crate::error::SimError;

            fn try_from(
                named: std::collections::BTreeMap<String, f64>,
            ) -> Result<Self, Self::Error> {
                let mut named = named.into_iter();
                named.try_fold(Self::default(), |numbers, (name, value)| {
                    numbers.with(name.parse()?, value)
                })
            }
        }
    };
}
