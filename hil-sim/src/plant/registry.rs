//! One line per kind: the parameters' enum and the constructor behind it.

/// Writes an enum of parameter structs, tagged by `kind`, whose `build` checks and boxes the thing described.
/// Each parameter struct brings `fn build(&self) -> Result<Thing, ParameterError>`.
macro_rules! registry {
    (
        $(#[$about:meta])*
        pub enum $name:ident builds dyn $thing:ident { $($(#[$doc:meta])* $kind:ident($parameters:ty),)+ }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, PartialEq, serde::Deserialize, serde::Serialize)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        pub enum $name { $($(#[$doc])* $kind($parameters),)+ }

        impl $name {
            /// Checks the parameters and builds what they describe.
            ///
            /// # Errors
            /// The first parameter outside its range.
            pub fn build(&self) -> Result<Box<dyn $thing>, ParameterError> {
                match self { $(Self::$kind(parameters) => Ok(Box::new(parameters.build()?)),)+ }
            }
        }
    };
}
pub(super) use registry;
