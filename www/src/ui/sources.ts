// From what the user gave to a source: dropped entries, picked folders and archives, addresses.
import type { SourceSpec } from "../client";

type Listed = { path: string; file: File };

/** A folder has fewer files than this, or was not meant. */
const MAX_FILES = 200_000;

/** What was dropped, as a source. */
export async function dropped(transfer: DataTransfer): Promise<SourceSpec> {
  // Entries are only there until the first pause, so all are taken before.
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry()).filter((e) => e !== null);
  const files = [...transfer.files];
  if (files.length === 1 && /\.zip$/i.test(files[0]!.name)) return archive(files[0]!);
  const found: Listed[] = [];
  for (const entry of entries) await walk(entry, "", found);
  const first = entries[0];
  if (found.length === 0) throw new Error("what was dropped holds no files");
  // One dropped folder is the recording; its own name is not part of the paths.
  const single = entries.length === 1 && first?.isDirectory;
  const name = single ? first.name : "dropped files";
  return { kind: "files", name, files: single ? found.map(({ path, file }) => ({ path: path.slice(name.length + 1), file })) : found };
}

async function walk(entry: FileSystemEntry, above: string, found: Listed[]): Promise<void> {
  const path = above + entry.name;
  if (found.length > MAX_FILES) throw new Error(`more than ${MAX_FILES} files: not a recording's folder`);
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    found.push({ path, file });
  } else if (entry.isDirectory) {
    const reader = (entry as FileSystemDirectoryEntry).createReader();
    for (;;) {
      // Some browsers give at most 100 entries at a time.
      const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
      if (some.length === 0) break;
      for (const inner of some) await walk(inner, `${path}/`, found);
    }
  }
}

/** A folder by the picker; `undefined` where there is none or it was closed. */
export async function pickFolder(): Promise<SourceSpec | undefined> {
  const picker = (window as { showDirectoryPicker?: () => Promise<FileSystemDirectoryHandle> }).showDirectoryPicker;
  if (!picker) return undefined;
  const folder = await picker.call(window);
  const found: Listed[] = [];
  await list(folder, "", found);
  return { kind: "files", name: folder.name, files: found };
}

async function list(folder: FileSystemDirectoryHandle, above: string, found: Listed[]): Promise<void> {
  const entries = folder as unknown as { values(): AsyncIterable<FileSystemHandle> };
  for await (const entry of entries.values()) {
    if (found.length > MAX_FILES) throw new Error(`more than ${MAX_FILES} files: not a recording's folder`);
    if (entry.kind === "file") found.push({ path: above + entry.name, file: await (entry as FileSystemFileHandle).getFile() });
    else await list(entry as FileSystemDirectoryHandle, `${above}${entry.name}/`, found);
  }
}

/** The files of `<input webkitdirectory>`. */
export function inputFolder(files: FileList): SourceSpec | undefined {
  const all = [...files];
  const name = all[0]?.webkitRelativePath.split("/")[0];
  if (!name) return undefined;
  return { kind: "files", name, files: all.map((file) => ({ path: file.webkitRelativePath.slice(name.length + 1), file })) };
}

export function archive(file: File): SourceSpec {
  return { kind: "zip", name: file.name, file };
}

/** An address: an archive by its ending, `serve:` for a server of frames, else a folder. */
export function address(text: string): SourceSpec {
  const stream = text.startsWith("serve:");
  const url = new URL(stream ? text.slice(6) : text, location.href);
  if (url.protocol !== "https:" && url.protocol !== "http:") throw new Error(`${text}: expected an https address`);
  if (stream) return { kind: "serve", url: url.href };
  return /\.zip$/i.test(url.pathname) ? { kind: "zip-url", url: url.href } : { kind: "http", url: url.href };
}
