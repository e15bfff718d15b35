// The last states of runs, in the browser's own database (IndexedDB) on this device: what a run goes
// on from after a lost device, a crash or a reload.

/** A run that can go on. */
export interface KeptRun {
  /** Names the run; a later state of it replaces an earlier one. */
  id: string;
  /** When its state was saved [ms since 1970]. */
  at: number;
  /** Frames processed, and frames in all. */
  frame: number;
  frames: number;
  /** Size of the state [bytes]. */
  size: number;
  /** What the page wants to know of it, for example where its frames come from. */
  about: unknown;
}

const NAME = "mte-slam";
/** Runs kept; the oldest goes first. */
const MOST = 2;

function result<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error ?? new Error("the browser's database failed"));
  });
}

function complete(transaction: IDBTransaction): Promise<void> {
  return new Promise((resolve, reject) => {
    const failed = () => reject(transaction.error ?? new Error("the browser's database failed"));
    transaction.oncomplete = () => resolve();
    transaction.onerror = failed;
    transaction.onabort = failed;
  });
}

async function open(): Promise<IDBDatabase> {
  if (typeof indexedDB === "undefined") throw new Error("this browser offers no database here");
  const request = indexedDB.open(NAME, 1);
  request.onupgradeneeded = () => {
    // Apart, so that runs can be listed without their states.
    request.result.createObjectStore("runs", { keyPath: "id" });
    request.result.createObjectStore("states");
  };
  return result(request);
}

/** Runs that can go on, the newest first; none where the browser keeps nothing. */
export async function kept(): Promise<KeptRun[]> {
  try {
    const database = await open();
    const all = await result<KeptRun[]>(database.transaction("runs").objectStore("runs").getAll());
    database.close();
    return all.sort((a, b) => b.at - a.at);
  } catch {
    return [];
  }
}

/** Keeps a state; the transaction takes the place of the former one as a whole or not at all. */
export async function put(run: KeptRun, state: Uint8Array): Promise<void> {
  const database = await open();
  try {
    const transaction = database.transaction(["runs", "states"], "readwrite");
    const [runs, states] = [transaction.objectStore("runs"), transaction.objectStore("states")];
    const others = (await result<KeptRun[]>(runs.getAll())).filter((other) => other.id !== run.id);
    for (const { id } of others.sort((a, b) => b.at - a.at).slice(MOST - 1)) {
      runs.delete(id);
      states.delete(id);
    }
    runs.put(run);
    states.put(state, run.id);
    await complete(transaction);
  } finally {
    database.close();
  }
}

/** The state of a run. */
export async function state(id: string): Promise<Uint8Array | undefined> {
  const database = await open();
  try {
    return await result<Uint8Array | undefined>(database.transaction("states").objectStore("states").get(id));
  } finally {
    database.close();
  }
}

/** Forgets a run. */
export async function forget(id: string): Promise<void> {
  const database = await open();
  try {
    const transaction = database.transaction(["runs", "states"], "readwrite");
    transaction.objectStore("runs").delete(id);
    transaction.objectStore("states").delete(id);
    await complete(transaction);
  } finally {
    database.close();
  }
}
