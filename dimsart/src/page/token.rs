//! The token of the page's address, as secret as the user's private files.

use std::fs;
use std::io;

use crate::broker::private_folder;

/// Its file in the private folder.
const FILE: &str = "page-token";
const BYTES: usize = 16;

/// Returns the token of this user's pages. It is kept until the computer shuts down, so that an open page reconnects to a
/// restarted server.
///
/// # Errors
/// An error of the system.
pub(super) fn token() -> io::Result<String> {
    let Ok(folder) = private_folder() else { return drawn() };
    let path = folder.join(FILE);
    let is_whole =
        |text: &String| text.len() == 2 * BYTES && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    if let Some(kept) = fs::read_to_string(&path).ok().filter(is_whole) {
        return Ok(kept);
    }
    let token = drawn()?;
    fs::write(path, &token)?;
    Ok(token)
}

fn drawn() -> io::Result<String> {
    let mut token = [0; BYTES];
    getrandom::fill(&mut token).map_err(io::Error::other)?;
    Ok(token.iter().map(|byte| format!("{byte:02x}")).collect())
}
