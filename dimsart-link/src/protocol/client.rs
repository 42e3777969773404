//! Client numbers of the hosts that share a line.

/// Number that means no client.
pub const NO_CLIENT: u8 = 0;

/// Returns the id of a client's request. A host draws its client number at random, 1 to 255, and draws a new
/// one if it receives a response that it did not request, or if that number already holds the lease.
#[must_use]
pub fn request_id(client: u8, number: u8) -> u16 {
    u16::from_le_bytes([number, client])
}

/// Returns the client that sent a request.
#[must_use]
pub fn request_client(id: u16) -> u8 {
    let [_, client] = id.to_le_bytes();
    client
}
