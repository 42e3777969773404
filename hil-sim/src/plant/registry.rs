//! One line per kind of environment: its name, and the parameters that build it.

/// Writes the list of what a slave can meet. The name of a kind is that of its section in a scenario; its
/// parameters bring `fn build(&self) -> Result<impl Environment, ParameterError>`.
macro_rules! environments {
    ($($(#[$doc:meta])* $section:ident: $kind:ident($parameters:ty),)+) => {
        /// What a slave meets; the name is that of a section of a scenario.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize, serde::Serialize)]
        #[serde(rename_all = "snake_case")]
        pub enum EnvironmentKind {
            /// Free space: there is no section for it.
            Nothing,
            $($(#[$doc])* $kind,)+
        }

        /// Parameters of every kind of environment, a section of a scenario each.
        #[derive(Debug, Clone, PartialEq, serde::Deserialize, serde::Serialize)]
        pub struct Environments {
            $($(#[$doc])* pub $section: $parameters,)+
        }

        impl Environments {
            /// Builds an environment of this kind; none for nothing.
            ///
            /// # Errors
            /// The first of its parameters outside its range.
            pub fn build(
                &self,
                kind: EnvironmentKind,
            ) -> Result<Option<Box<dyn Environment>>, ParameterError> {
                match kind {
                    EnvironmentKind::Nothing => Ok(None),
                    $(EnvironmentKind::$kind => {
                        let built = self.$section.build();
                        let built = built.map_err(|error| error.within(stringify!($section)))?;
                        Ok(Some(Box::new(built)))
                    })+
                }
            }
        }
    };
}
pub(super) use environments;
