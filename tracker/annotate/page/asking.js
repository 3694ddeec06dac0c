/** What the server answers, to a page that says by GONE what it means that there is none any more. */
async function ask(what, body) {
  const headers = { "Content-Type": "application/json" };
  let answer;
  try {
    answer = await fetch(what, body && { method: "POST", headers, body: JSON.stringify(body) });
  } catch {
    throw new Error(GONE);
  }
  const reply = await answer.json();
  if (!answer.ok) throw new Error(reply.error);
  return reply;
}
