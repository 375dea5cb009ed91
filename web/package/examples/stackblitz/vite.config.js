export default { worker: { format: "es" }, optimizeDeps: { exclude: ["@cagework/core"] } };
