// Target: a request to the web server of `demo`, without the empty line at its end.
#include <string>

#include "base/text.h"
#include "extras/deploy/http.h"
#include "tools/fuzz/target.h"

namespace upswing {

using namespace deploy;

bool TryInput(std::string_view input) {
  const HttpRequest request = ParseHttpRequest(input);
  if (request.refusal != 0) {
    Expect(!request.keeps_alive, "the end of the connection");
    return false;
  }
  Expect(request.path.starts_with('/'), "an absolute path");
  std::string encoded = "/";
  for (const char c : request.path.substr(1)) {
    Expect(static_cast<unsigned char>(c) >= 0x20, "no control character");
    encoded += Concat('%', HexDigits(static_cast<unsigned char>(c), 2));
  }
  const HttpRequest again =
      ParseHttpRequest(Concat("GET ", encoded, " HTTP/1.1\r\nHost: localhost"));
  Expect(again.refusal == 0 && again.path == request.path, "the same path");
  return true;
}

}  // namespace upswing
