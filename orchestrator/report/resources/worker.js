// The thread in which a live page simulates: one run for each message, to its end.
let master = null;
onmessage = ({ data }) => {
  const begin = performance.now();
  let error = "";
  try {
    if (data.plan) master = new Master(data.plan, data.modules.map((bytes) => new WebAssembly.Module(bytes)));
    master.begin(data.given, data.wanted);
    master.run();
  } catch (thrown) { error = thrown.message; }
  const columns = master?.columns ?? [];
  postMessage({ columns, error, milliseconds: performance.now() - begin }, columns.map((column) => column.buffer));
};
