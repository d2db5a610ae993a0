#include "proto/wire/problem.h"

#include <array>

#include <nlohmann/json.hpp>

namespace tessera::proto {
namespace {

// In the order of the enumeration: `entry` looks rows up by index, and a test holds the two together.
constexpr std::array kTable{
    ProblemEntry{ProblemCode::malformed_json, "malformed_json", 400, "The body is not well-formed JSON",
                 "The body breaks the grammar of JSON (RFC 8259), isn't UTF-8, or nests "
                 "too deep; `detail` says where. Mend the document and send it again."},
    ProblemEntry{ProblemCode::malformed_request, "malformed_request", 400, "The request is malformed",
                 "The request breaks a rule of HTTP, or has a query parameter that the resource doesn't know or can't "
                 "use, or a form or an archive that can't be used; `detail` and `errors` say which. Sending it again "
                 "won't help."},
    ProblemEntry{ProblemCode::unauthorized, "unauthorized", 401, "A key is needed",
                 "The server answers nobody without a key, and none was shown, or one that isn't valid. Send it as the "
                 "header Authorization: Bearer and the key; who runs the server makes one with `tessera keys add`."},
    ProblemEntry{
        ProblemCode::forbidden, "forbidden", 403, "This is not allowed",
        "The server understands the request and won't do it for who asks: the key lacks a scope, or doesn't "
        "let its bearer do so much; or the request comes from a web page of another origin, which who runs the "
        "server can allow by --cors-origin."},
    ProblemEntry{ProblemCode::not_found, "not_found", 404, "There is no such resource",
                 "Nothing is at this path: it is misspelt, or what it names was never there, or has been deleted or "
                 "forgotten. GET /openapi.json lists all paths."},
    ProblemEntry{ProblemCode::method_not_allowed, "method_not_allowed", 405, "The resource has no such method",
                 "The path is right, the method isn't: the Allow header lists those that the resource knows."},
    ProblemEntry{
        ProblemCode::not_acceptable, "not_acceptable", 406, "No acceptable representation",
        "Nothing that the server can make of the resource is among what the Accept header, or the query, asks for."},
    ProblemEntry{ProblemCode::request_timeout, "request_timeout", 408, "The request took too long to arrive",
                 "A request was begun and not sent to its end in the time that the server gives; it has closed the "
                 "connection. Send the request again."},
    ProblemEntry{ProblemCode::image_not_ready, "image_not_ready", 409, "The image is not ready",
                 "The job hasn't come to its image yet, or ended without one. Ask again when its state is completed, "
                 "or for what there is of it with ?partial=1."},
    ProblemEntry{ProblemCode::job_still_active, "job_still_active", 409, "The job has not ended",
                 "Only jobs that have ended can be deleted. Cancel the job first, or wait for its end."},
    ProblemEntry{ProblemCode::job_already_ended, "job_already_ended", 409, "The job has already ended",
                 "The job is completed, failed or canceled, so there is nothing left to cancel."},
    ProblemEntry{ProblemCode::in_use, "in_use", 409, "It is in use",
                 "A job that hasn't ended, a stored scene or a request that is being answered needs it; `detail` says "
                 "which of these. Delete that first, or wait for its end."},
    ProblemEntry{
        ProblemCode::request_in_progress, "request_in_progress", 409, "The same request is in progress",
        "A request with the same Idempotency-Key came before this one and hasn't been answered yet. Send this one "
        "again soon: it will be answered as that one was."},
    ProblemEntry{ProblemCode::image_gone, "image_gone", 410, "The image is gone",
                 "The job has ended, and its image gave way to those of newer jobs. Submit the job again for it."},
    ProblemEntry{
        ProblemCode::gone, "gone", 410, "It has expired",
        "It was here, and wasn't used for as long as the server keeps such things, or gave way to others. Send "
        "it again."},
    ProblemEntry{ProblemCode::payload_too_large, "payload_too_large", 413, "The body is too large",
                 "The body is larger than the server takes here; GET /v1/capabilities tells the limits, and who runs "
                 "the server can raise them."},
    ProblemEntry{ProblemCode::job_too_large, "job_too_large", 413, "The job is too large for this server",
                 "The job's image, or its scene with the structure over it, would take more memory than the server has "
                 "for all of them; `errors` says which, and how much. Ask for less, or have the server given more."},
    ProblemEntry{ProblemCode::target_too_long, "target_too_long", 414, "The target of the request is too long",
                 "The first line of the request is longer than any that the server knows an answer to."},
    ProblemEntry{ProblemCode::unsupported_media_type, "unsupported_media_type", 415,
                 "The body's media type is not supported",
                 "Documents are taken as application/json; what is to be rendered, by its Content-Type or its content; "
                 "neither with a Content-Encoding."},
    ProblemEntry{ProblemCode::range_not_satisfiable, "range_not_satisfiable", 416, "There are no such bytes",
                 "The Range header asks for bytes beyond the last: Content-Range says how many there are. It may have "
                 "another length than before; without a Range all of it is sent."},
    ProblemEntry{ProblemCode::expectation_failed, "expectation_failed", 417, "The expectation can not be met",
                 "The Expect header asks for something else than 100-continue."},
    ProblemEntry{
        ProblemCode::misdirected_request, "misdirected_request", 421, "The server isn't called by this name",
        "The Host header names another host than the server takes itself for: who runs it tells it its names by "
        "--host-name. So that no web page gets at it by turning a name of its own onto its address."},
    ProblemEntry{ProblemCode::invalid_document, "invalid_document", 422, "The document is not valid",
                 "The document is JSON, but not what the schema, or the files that it names, allow; `errors` says "
                 "where, what is wrong and how to mend it."},
    ProblemEntry{ProblemCode::hash_mismatch, "hash_mismatch", 422, "The content does not have the stated hash",
                 "The bytes that came aren't those that the path names: the path has the hash of another file, or the "
                 "file changed on its way."},
    ProblemEntry{
        ProblemCode::idempotency_key_reused, "idempotency_key_reused", 422,
        "The idempotency key belongs to another request",
        "The Idempotency-Key was sent before with another body, and names the job that came of that. Send this "
        "body with a key of its own."},
    ProblemEntry{ProblemCode::too_many_jobs, "too_many_jobs", 429, "Too many jobs are waiting",
                 "As many jobs wait or render as the server takes. Try again when some have ended."},
    ProblemEntry{ProblemCode::quota_exceeded, "quota_exceeded", 429, "The key's quota is used up",
                 "More was asked for than the key lets its bearer have, in requests, jobs, samples or stored bytes; "
                 "`detail` says which, Retry-After when there is some of it again."},
    ProblemEntry{ProblemCode::headers_too_large, "headers_too_large", 431, "The headers are too large",
                 "The headers, or the trailers after a chunked body, are longer or more than the server takes."},
    ProblemEntry{ProblemCode::out_of_memory_budget, "out_of_memory_budget", 503, "The server is short of memory",
                 "What the server may spend on documents, images or this request is spent at the moment. Try again "
                 "later, or send less."},
    ProblemEntry{ProblemCode::not_ready, "not_ready", 503, "The server takes no jobs now",
                 "The jobs that haven't ended are as many, or their images as large, as the server takes, and it is "
                 "ready again when some have ended; or its disk is full or lost. `checks` says which."},
    ProblemEntry{ProblemCode::shutting_down, "shutting_down", 503, "The server is shutting down",
                 "The server is about to stop and takes nothing new. Try again when it, or another one, is up."},
    ProblemEntry{ProblemCode::storage_unavailable, "storage_unavailable", 503, "The server's disk is not available",
                 "The folder in which the server keeps its files is gone, can't be written to, or fails. Try again "
                 "when who runs the server has mended that."},
    ProblemEntry{ProblemCode::reader_unavailable, "reader_unavailable", 503, "Files can not be read now",
                 "Files are read in processes of their own, so that one that breaks a library does no harm, and the "
                 "system gives the server no such process. Try again later."},
    ProblemEntry{ProblemCode::insufficient_storage, "insufficient_storage", 507, "The server's disk is full",
                 "There is no room for this on the server's disk. Try again when some has been made, or send less."},
    ProblemEntry{ProblemCode::not_implemented, "not_implemented", 501, "The server can not do this",
                 "The method, or the coding of the body, is one that no resource of this server knows."},
    ProblemEntry{ProblemCode::version_not_supported, "version_not_supported", 505,
                 "The version of HTTP is not supported", "The server speaks HTTP/1.1 and HTTP/1.0."},
    ProblemEntry{ProblemCode::internal_error, "internal_error", 500, "The server made a mistake",
                 "Something went wrong that isn't the request's fault; the server's log says what."},
};

}  // namespace

std::span<const ProblemEntry> problem_table() { return kTable; }

const ProblemEntry& entry(ProblemCode code) { return kTable.at(static_cast<std::size_t>(code)); }

nlohmann::json to_json(const Problem& problem) {
  const ProblemEntry& row = entry(problem.code);
  nlohmann::json json{{"type", "/problems/" + std::string(row.name)},
                      {"title", row.title},
                      {"status", row.status},
                      {"detail", problem.detail},
                      {"code", row.name}};
  nlohmann::json& errors = json["errors"] = nlohmann::json::array();
  for (const FieldError& error : problem.errors)
    errors.push_back({{"pointer", error.pointer}, {"detail", error.detail}});
  return json;
}

}  // namespace tessera::proto
