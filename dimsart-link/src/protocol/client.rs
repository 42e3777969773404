//! Clients: numbers of the hosts that share a line.

/// Number of no client.
pub const NO_CLIENT: u8 = 0;

/// The id of a client's request. A host draws its client number at random, 1 to 255, and draws another one when it
/// hears an answer to it that it never asked for, or finds the lease held by it before it took it.
#[must_use]
pub fn request_id(client: u8, number: u8) -> u16 {
    u16::from_le_bytes([number, client])
}

/// The client that a request came from, and its answer goes to.
#[must_use]
pub fn client_of(id: u16) -> u8 {
    let [_, client] = id.to_le_bytes();
    client
}
