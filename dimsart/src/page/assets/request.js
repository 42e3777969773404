// Requests to the server outside the WebSocket: recordings and computations.

/** Posts a body; returns the response, or throws the server's reason. */
export async function post(path, body, token) {
  const response = await fetch(`/${path}?token=${token}`, { method: "POST", body });
  if (!response.ok) throw new Error(await response.text());
  return response;
}
