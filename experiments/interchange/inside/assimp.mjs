// assimp: a BVH or GLB file in, GLB out.
import assimp from "assimpjs";
import { back, clip, way } from "./given.mjs";

const ajs = await assimp();
const files = new ajs.FileList();
files.AddFile(`clip.${way}`, clip(way));
const result = ajs.ConvertFileList(files, "glb2");
if (!result.IsSuccess() || !result.FileCount()) throw new Error(result.GetErrorCode());
back(result.GetFile(0).GetContent());
